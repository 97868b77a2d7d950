// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <optional>

#include <fmt/format.h>

#include "clients/connection/passing.hpp"
#include "clients/slsctl/asked_part.hpp"
#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/recording.hpp"
#include "clients/slsctl/report.hpp"
#include "drivers/system/interrupt.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;
using Scanned = tl::expected<Answered, Failure>;
using namespace std::chrono_literals;

// Longer than a camera needs to return after it was unplugged, but short enough not to waste a night.
constexpr auto kTimeout = 60s;

json scan_parameters(const ClientOptions& options) {
  json params{{"format", "ply"}, {"frames", "raw"}, {"coordinate_frame", "rig"}};  // as its replay
  params.update(asked_part(options));
  if (!options.density.empty()) params["density"] = options.density;
  if (options.normals) params["density"] = "pixels", params["normals"] = true;
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  return params;
}

/// The settings with which a replay gives the clouds that the scans ask for.
json replayed_settings(json settings, const ClientOptions& options) {
  const json params = scan_parameters(options), part = asked_part(options);
  json& configuration = settings["configuration"];
  if (params.contains("density")) configuration["decode"]["density"] = params["density"];
  if (!part.empty()) configuration["cloud"].update(part);
  return settings;
}

class Recorder {
 public:
  /// @param settings  those at the beginning
  Recorder(const ClientOptions& options, Connection connection, Recording recording, json settings)
      : options_(options),
        connection_(std::move(connection)),
        recording_(std::move(recording)),
        settings_(std::move(settings)) {}

  /// Runs the recording. Returns the first error that ended it early.
  /// @param first  a scan that was made already
  [[nodiscard]] std::optional<Failure> run(const std::optional<Scanned>& first) {
    std::optional<Failure> failed;
    bool ends = false;
    if (first) failed = keep(*first), ends = enough(0);
    if (!failed && !ends) failed = ask_for_scan();
    while (!failed && !ends) {
      auto reply = connection_.reply();
      if (!reply) failed = failure(reply.error());
      if (failed) break;
      const Scanned answered = judge(std::move(reply));
      ends = enough(answered ? 1 : 0);
      if (!ends) failed = ask_for_scan();
      if (auto kept = keep(answered)) failed = kept;
      show_progress();
    }
    if (!failed) failed = check_settings();
    if (auto finished = recording_.finish(); !finished && !failed) failed = file_failure(finished.error());
    end_progress();
    return failed;
  }

  [[nodiscard]] json summary() const {
    return {{"folder", options_.folder.string()},
            {"scans", recording_.scans()},
            {"failed", recording_.failures()},
            {"bytes_written", recording_.bytes()},
            {"seconds", seconds()}};
  }

 private:
  /// @param coming  scans not written yet
  [[nodiscard]] bool enough(std::uint64_t coming) const {
    if (Interrupt::came()) return true;
    if (options_.count > 0 && recording_.scans() + coming >= options_.count) return true;
    return options_.seconds && seconds() >= *options_.seconds;
  }

  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  [[nodiscard]] static Failure file_failure(const Error& error) { return {kRequestFailed, rpc_error(error)}; }

  [[nodiscard]] std::optional<Failure> ask_for_scan() {
    if (auto sent = connection_.request("scan", scan_parameters(options_)); !sent) return failure(sent.error());
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Failure> keep(const Scanned& answered) {
    if (!answered) return keep_failure(answered.error());
    last_good_ = Clock::now();
    if (auto kept = recording_.add(*answered); !kept) return file_failure(kept.error());
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Failure> keep_failure(const Failure& failure) {
    if (!passes(failure.error.name) || Clock::now() - last_good_ > kTimeout) return failure;
    if (auto kept = recording_.add_failure(failure.error.to_json()); !kept) return file_failure(kept.error());
    return std::nullopt;
  }

  // After a reload, the service decodes later frames with a pattern or calibration that was not recorded.
  [[nodiscard]] std::optional<Failure> check_settings() {
    const auto now = ask(connection_, "settings", json::object());
    if (!now) return now.error();
    if (now->reply.message["result"] == settings_) return std::nullopt;
    return file_failure({ErrorCode::kMismatch,
                         "the service was reloaded while recording, so the last scans have other settings than the "
                         "recording says; record again",
                         options_.folder.string()});
  }

  void show_progress() const {
    if (options_.json || ::isatty(STDERR_FILENO) == 0) return;
    std::cerr << fmt::format("\r{} scans, {} failed, {:.1f} MB, {:.1f} s, {:.1f} per second ", recording_.scans(),
                             recording_.failures(), static_cast<double>(recording_.bytes()) / 1e6, seconds(),
                             static_cast<double>(recording_.scans()) / seconds())
              << std::flush;
  }

  void end_progress() const {
    if (!options_.json && ::isatty(STDERR_FILENO) != 0) std::cerr << "\n";
  }

  const ClientOptions& options_;
  Connection connection_;
  Recording recording_;
  json settings_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_good_ = begin_;
};

std::string summary_line(const json& summary) {
  return fmt::format("{}: {} scans, {} failed, {:.1f} MB in {:.1f} s\n", summary.value("folder", ""),
                     summary.value("scans", 0), summary.value("failed", 0), summary.value("bytes_written", 0.0) / 1e6,
                     summary.value("seconds", 0.0));
}

}  // namespace

int record_command(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return report(options, failure(connection.error()));
  std::optional<Scanned> first;
  if (!options.preset.empty()) {  // a scan puts it into force; the settings are then the preset's
    json params = scan_parameters(options);
    params["preset"] = options.preset;
    first = ask(*connection, "scan", params);
    if (!*first) return report(options, first->error());
  }
  auto settings = ask(*connection, "settings", json::object());
  if (!settings) return report(options, settings.error());
  json& told = settings->reply.message["result"];
  auto recording = Recording::create(options.folder, replayed_settings(told, options), options.clouds);
  if (!recording) return report(options, {kRequestFailed, rpc_error(recording.error())});
  Interrupt::watch();
  Recorder recorder(options, std::move(*connection), std::move(*recording), std::move(told));
  const auto failed = recorder.run(first);
  if (failed) return report(options, *failed);
  const json summary = recorder.summary();
  std::cout << (options.json ? to_line(summary) : summary_line(summary));
  return kDone;
}

}  // namespace slsd
