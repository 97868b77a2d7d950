// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <malloc.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>

#include "core/printable.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/message_ids.hpp"
#include "daemon/service/notifier.hpp"
#include "daemon/service/service.hpp"
#include "drivers/log/logging.hpp"
#include "drivers/system/own_program.hpp"
#include "programs/command_line.hpp"
#include "programs/start_calibrating.hpp"

namespace {

constexpr int kWrongConfiguration = 78;  // EX_CONFIG; the unit does not restart the service after it
constexpr int kOwnPagesBytes = 1 << 20;

/// Tells whether the same start may succeed later without any change by a user: when a volume is mounted, or another
/// daemon ends.
bool may_pass(slsd::ErrorCode code) {
  using slsd::ErrorCode;
  constexpr std::array kLasting{ErrorCode::kInvalidArgument, ErrorCode::kMalformed,   ErrorCode::kMismatch,
                                ErrorCode::kImpossible,      ErrorCode::kUnsupported, ErrorCode::kPermissionDenied,
                                ErrorCode::kAlreadyExists};
  return std::ranges::find(kLasting, code) == kLasting.end();
}

int not_served(const slsd::Error& error, bool passes) {
  const std::string why = to_string(error);
  const slsd::MessageId id(slsd::MessageId::kDoesNotStart);
  spdlog::critical("{}", why);
  slsd::Notifier().status("does not start: " + slsd::printable(why, 1000));  // as `systemctl status` shows it
  return passes ? slsd::kFailed : kWrongConfiguration;
}

constexpr std::string_view kNoMemory =
    "no memory is left: end other programs, or raise the limit (MemoryMax= of the unit, ulimit -v)";

/// Ends the service if memory ran out on a thread that has no request to refuse. The unit starts it again.
[[noreturn]] void end_thread() noexcept {
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    const std::string_view parts[] = {"slsd: ", kNoMemory, "\n"};
    for (const std::string_view part : parts)
      if (::write(STDERR_FILENO, part.data(), part.size()) < 0) break;
    std::_Exit(slsd::kFailed);
  } catch (...) {  // a bug: its core shows where
  }
  std::abort();
}

using MadeService = slsd::Result<std::unique_ptr<slsd::Service>>;

/// Makes the service with the kept settings, as far as they still fit: they never prevent a start.
MadeService make_service(const std::filesystem::path& file, slsd::Configuration configuration) {
  const auto kept_file = slsd::kept_settings_file(file);
  const auto kept = slsd::read_kept_settings(kept_file);
  std::optional<slsd::Error> why;
  if (!kept) {
    why = kept.error();
  } else if (!kept->empty()) {
    auto with_kept = slsd::load_configuration_with(file, *kept);
    MadeService made = with_kept ? slsd::Service::create(std::move(*with_kept), file, *kept)
                                 : MadeService(tl::unexpected(with_kept.error()));
    if (made) return made;
    why = made.error();
  }
  if (why) spdlog::warn("{}: ignoring the settings made over the socket: {}", kept_file.string(), to_string(*why));
  return slsd::Service::create(std::move(configuration), file, nlohmann::json::object());
}

int serve(const std::filesystem::path& configuration_file) {
  // Otherwise the first freed frame buffer raises this threshold, and cameras that come and go fragment the heap: by 20
  // % after 240 losses of a camera.
  ::mallopt(M_MMAP_THRESHOLD, kOwnPagesBytes);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGIO, SIG_IGN);   // for leases that watch lent memfds, if another process opens one
  std::signal(SIGHUP, SIG_IGN);  // a reload would read what is about to be read anyway
  spdlog::info("slsd {} starts with {}", SLSD_VERSION, configuration_file.string());
  slsd::queue_log(slsd::MessageId::kLogDropped);
  auto configuration = slsd::load_configuration(configuration_file);
  if (!configuration) {
    // If the file exists, kNotFound means a user or a group, which another host may provide later.
    const slsd::ErrorCode code = configuration.error().code;
    std::error_code ignored;
    const bool named = code == slsd::ErrorCode::kNotFound && std::filesystem::exists(configuration_file, ignored);
    return not_served(configuration.error(), named || code == slsd::ErrorCode::kIo);
  }
  auto service = make_service(configuration_file, std::move(*configuration));
  if (service) (*service)->set_calibrator(slsd::find_own_program(slsd::kCalibrator));
  const auto served = service ? (*service)->run() : slsd::Result<>(tl::unexpected(service.error()));
  return served ? slsd::kDone : not_served(served.error(), may_pass(served.error().code));
}

/// Serves; reports a lack of memory or threads, which libraries throw.
int serve_within_limits(const std::filesystem::path& configuration_file) {
  std::set_terminate(end_thread);
  try {
    return serve(configuration_file);
  } catch (const std::bad_alloc&) {
    return not_served({slsd::ErrorCode::kNoSpace, std::string(kNoMemory), {}}, true);
  } catch (const std::system_error& error) {
    return not_served({slsd::ErrorCode::kNoSpace,
                       "cannot start a thread (" + error.code().message() +
                           "): raise the limits of memory and threads (MemoryMax= and TasksMax= of the unit, ulimit)",
                       {}},
                      true);
  }
}

int check_configuration(const slsd::CommandLine& line) {
  const auto checked = slsd::check_configuration(line.configuration);
  const int status = slsd::exit_status(checked);
  return checked || may_pass(checked.error().code) ? status : kWrongConfiguration;
}

int carry_out(const slsd::CommandLine& line) {
  if (!line.pattern_image.empty())
    return slsd::exit_status(slsd::write_pattern_image(line.configuration, line.pattern_image));
  if (!line.bundle.empty()) return slsd::exit_status(slsd::replay_bundle(line.bundle, line.folder));
  if (line.list) return slsd::exit_status(slsd::list_devices(line.configuration, line.as_json));
  if (line.check_configuration) return check_configuration(line);
  if (line.check) return slsd::check_everything(line.configuration) ? slsd::kDone : slsd::kFailed;
  // One name for good: a reload compares its paths with those at the start.
  std::error_code ignored;
  const std::filesystem::path file = line.configuration.value_or(slsd::kConfigurationFile);
  const auto absolute = std::filesystem::absolute(file, ignored);
  return serve_within_limits(absolute.empty() ? file : absolute);
}

}  // namespace

int main(int argc, char** argv) {
  const auto line = slsd::parse_command_line(argc, argv);
  if (!line) return line.error();
  if (line->calibrates()) return slsd::exit_status(slsd::start_calibrating(argv));
  slsd::start_logging(spdlog::level::from_str(line->level));
  const int status = carry_out(*line);
  slsd::flush_log(status == EXIT_SUCCESS ? slsd::kLogTimeout : slsd::kFailureLogTimeout);
  return status;
}
