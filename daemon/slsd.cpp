// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <malloc.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "core/printable.hpp"
#include "daemon/calibrate/calibrate_from_files.hpp"
#include "daemon/calibrate/session.hpp"
#include "daemon/calibrate/verify_from_files.hpp"
#include "daemon/calibrate/verify_live.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/message_ids.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/notifier.hpp"
#include "daemon/service/service.hpp"

namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr int kWrongConfiguration = 78;  // EX_CONFIG; the unit does not start the service again
constexpr int kOwnPagesBytes = 1 << 20;

/// Whether the same start may succeed later, with nobody having changed anything: when a volume is mounted, or another
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
  return passes ? kFailed : kWrongConfiguration;
}

int serve(const std::filesystem::path& configuration_file) {
  // Else the first frame's buffer that is freed raises this, and those of cameras that come and go fragment the heap:
  // by 20 % in 240 losses of one.
  ::mallopt(M_MMAP_THRESHOLD, kOwnPagesBytes);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGIO, SIG_IGN);   // of the leases by which lent memfds are watched, should anybody else open one
  std::signal(SIGHUP, SIG_IGN);  // what a reload would read is about to be read
  spdlog::info("slsd {} starts with {}", SLSD_VERSION, configuration_file.string());
  slsd::queue_log();
  auto configuration = slsd::load_configuration(configuration_file);
  if (!configuration) return not_served(configuration.error(), configuration.error().code == slsd::ErrorCode::kIo);
  auto service = slsd::Service::create(std::move(*configuration), configuration_file);
  const auto served = service ? (*service)->run() : slsd::Result<>(tl::unexpected(service.error()));
  return served ? kDone : not_served(served.error(), may_pass(served.error().code));
}

int report(const slsd::Result<>& result) {
  if (!result) std::cerr << "slsd: " << to_string(result.error()) << "\n";
  return result ? kDone : kFailed;
}

/// What the command line asks for.
struct CommandLine {
  std::optional<std::filesystem::path> configuration;
  std::string level = "info";
  std::filesystem::path pattern_image;
  bool check = false, check_configuration = false, list = false, as_json = false;
  bool calibrate = false, latency = false, verify = false;
  slsd::CalibrateRequest request;
  slsd::PrintRequest print;
};

void add_calibration_options(CLI::App& app, CommandLine& line) {
  slsd::CalibrateRequest& request = line.request;
  auto* calibrate = app.get_option("--calibrate");
  auto* latency = app.add_flag("--latency", line.latency, "with --calibrate: how late each camera sees the projector");
  latency->needs(calibrate);
  app.add_option("--output", request.output, "with --calibrate: the file that it is kept in")->needs(calibrate);
  app.add_option("--from", request.from, "a folder of captures, without any hardware")->excludes(latency);
  app.add_option(
         "--board", request.board,
         "charuco:COLSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY (squares), chessboard:COLSxROWS:SQUARE_MM (inner corners), "
         "circles:COLSxROWS:SPACING_MM:DIAMETER_MM, plane:COLSxROWS:PITCH_MM:MARKER_MM:DICTIONARY")
      ->excludes(latency);
  app.add_option("--ruler", request.ruler,
                 "NOMINAL:MEASURED, in mm: what the ruler on the print says and what it measures")
      ->excludes(latency);
  app.add_option("--plane", request.plane,
                 "with --calibrate: the reference plane of the second step, such as plane:8x5:100:40:DICT_4X4_50")
      ->needs(calibrate)
      ->excludes(latency);
  app.add_option("--plane-ruler", request.plane_ruler, "as --ruler, of the reference plane's print")->needs("--plane");
  app.add_option("--planes", request.planes, "with --plane: how many looks at it a session takes")
      ->check(CLI::Range(1, 99))
      ->needs("--plane");
  app.add_option("--use", request.use, "with --calibrate --from: FIRST:LAST, the poses of that part alone")
      ->needs(calibrate)
      ->needs("--from");
  app.add_flag("--force", request.force,
               "with --calibrate: replace the calibration in force though distances are of another scale by it")
      ->needs(calibrate);
  const auto choose_code = [&request](const std::string& code) { request.gray_code = code == "gray"; };
  app.add_option_function<std::string>("--code", choose_code,
                                       "what is projected: the pattern, or a Gray code that takes many pictures a pose")
      ->check(CLI::IsMember({"pattern", "gray"}))
      ->needs(calibrate);
  app.add_option("--poses", request.poses, "with --calibrate: how many poses a session takes")
      ->check(CLI::Range(3, 99))
      ->needs(calibrate);
  app.add_option("--record", request.record,
                 "with --calibrate: the folder that the captures go to; poses in it already are taken over")
      ->needs(calibrate);
}

CLI::Option* add_print_options(CLI::App& app, slsd::PrintRequest& request) {
  auto* print = app.add_option("--print-board", request.file, "write a board for calibrating: .pdf, .svg or .png");
  app.add_option("--paper", request.paper, "A0 to A4, letter or WIDTHxHEIGHT in mm")->needs(print);
  app.add_option("--dpi", request.dpi, "of a board that is a PNG")->needs(print);
  return print;
}

void add_options(CLI::App& app, CommandLine& line) {
  app.set_version_flag("--version", "slsd " SLSD_VERSION);
  app.add_option("--config", line.configuration,
                 "configuration file; without it " + std::string(slsd::kConfigurationFile));
  app.add_option("--log-level", line.level, "least level that is logged")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "critical"}));
  auto* pattern = app.add_option("--pattern", line.pattern_image, "write the image that the projector shows, as a PNG");
  auto* check = app.add_flag("--check", line.check, "look at everything that a scan needs, and say what to do");
  auto* check_configuration = app.add_flag("--check-config", line.check_configuration,
                                           "look at the configuration alone: no device, no service");
  auto* list = app.add_flag("--list", line.list, "list the cameras and projectors that are seen");
  app.add_flag("--json", line.as_json, "list as JSON")->needs(list);
  auto* calibrate = app.add_flag("--calibrate", line.calibrate, "measure the scanner itself");
  auto* verify = app.add_flag("--verify", line.verify, "measure a board or a plane with the calibration in force");
  add_calibration_options(app, line);
  calibrate->excludes(verify)->excludes(pattern)->excludes(check)->excludes(list);
  verify->excludes(pattern)->excludes(check)->excludes(list);
  pattern->excludes(check)->excludes(list);
  check->excludes(list);
  check_configuration->excludes(calibrate)->excludes(verify)->excludes(pattern)->excludes(check)->excludes(list);
  add_print_options(app, line.print)
      ->excludes(pattern)
      ->excludes(calibrate)
      ->excludes(verify)
      ->excludes(check)
      ->excludes(check_configuration)
      ->excludes(list);
}

/// --from, --board and --ruler belong to several commands.
void check_commands(const CLI::App& app, const CommandLine& line) {
  if (line.verify && app.count("--ruler") > 0 && app.count("--board") == 0) {
    throw CLI::RequiresError("--ruler with --verify", "--board");
  }
  if (line.calibrate || line.verify) return;
  for (const char* option : {"--from", "--ruler"}) {
    if (app.count(option) > 0) throw CLI::RequiresError(option, "--calibrate or --verify");
  }
  if (app.count("--board") > 0 && line.print.file.empty()) {
    throw CLI::RequiresError("--board", "--calibrate, --verify or --print-board");
  }
}

int check_configuration(const CommandLine& line) {
  const auto checked = slsd::check_configuration(line.configuration);
  if (checked) return kDone;
  std::cerr << "slsd: " << to_string(checked.error()) << "\n";
  return may_pass(checked.error().code) ? kFailed : kWrongConfiguration;
}

int calibrate(const CommandLine& line) {
  if (line.latency) return report(slsd::calibrate_latency(line.configuration, line.request.output));
  return report(line.request.from.empty() ? slsd::calibrate_by_session(line.request)
                                          : slsd::calibrate_from_files(line.request));
}

int carry_out(const CommandLine& line) {
  if (!line.pattern_image.empty()) return report(slsd::write_pattern_image(line.configuration, line.pattern_image));
  if (!line.print.file.empty()) return report(slsd::print_board(line.print));
  if (line.calibrate) return calibrate(line);
  if (line.verify)
    return report(line.request.from.empty() ? slsd::verify_live(line.request) : slsd::verify_from_files(line.request));
  if (line.list) return report(slsd::list_devices(line.configuration, line.as_json));
  if (line.check_configuration) return check_configuration(line);
  if (line.check) return slsd::check_everything(line.configuration) ? kDone : kFailed;
  return serve(line.configuration.value_or(slsd::kConfigurationFile));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The service of a single-shot structured-light scanner. Without an option it serves in the foreground.");
  CommandLine line;
  add_options(app, line);
  try {
    app.parse(argc, argv);
    check_commands(app, line);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  }
  line.request.configuration_file = line.configuration;
  line.print.board = line.request.board;
  slsd::start_logging(spdlog::level::from_str(line.level));
  const int status = carry_out(line);
  slsd::flush_log(slsd::kLogPatience);
  return status;
}
