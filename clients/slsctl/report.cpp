// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/report.hpp"

#include <filesystem>
#include <iostream>
#include <system_error>

#include <fmt/format.h>

#include "clients/slsctl/output.hpp"
#include "core/calibrate/watch/drift_watch.hpp"
#include "core/printable.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestText = 1000;

/// A text from the daemon, made safe for a terminal: it may quote clients, devices and files.
std::string text_of(const json& about, const char* key) {
  return printable(about.value(key, ""), kLongestText);
}

/// A line about a camera that was knocked out of its calibration; empty while the calibration holds.
std::string drift_line(const json& camera) {
  const json drift = camera.value("calibration", json());
  if (!drift.is_object() || !drift.value("off_since_scan", json()).is_number()) return {};
  return fmt::format(
      "            knocked out of its calibration since scan {}: {:.2f} px off the epipolar lines, {:.2f} are fine\n"
      "            {}\n",
      drift.value("off_since_scan", std::uint64_t{0}), drift.value("epipolar_px", 0.0), drift.value("limit_px", 0.0),
      kKnockRemedy);
}

std::string device_line(const json& device) {
  std::string what = text_of(device, "driver");
  if (const std::string name = text_of(device, "device"); name != what) what += " " + name;
  std::string line = fmt::format("{:<12}{}, {}, {}x{} px", text_of(device, "name"), text_of(device, "state"), what,
                                 device.value("width_px", 0), device.value("height_px", 0));
  if (const std::string shows = text_of(device, "shows"); !shows.empty()) line += ", shows " + shows;
  if (device.contains("frames")) {
    line += fmt::format(", {} frames, {} lost", device.value("frames", std::uint64_t{0}),
                        device.value("frames_lost", std::uint64_t{0}));
  }
  const std::string problem = text_of(device, "problem");
  return line + (problem.empty() ? "\n" : "\n            " + problem + "\n") + drift_line(device);
}

std::string scans_lines(const json& scans) {
  std::string text = fmt::format("scans       {} succeeded", scans.value("succeeded", std::uint64_t{0}));
  const json failed = scans.value("failed", json::object());
  for (const auto& [name, count] : failed.items()) {
    text += fmt::format(", {} {}", count.get<std::uint64_t>(), printable(name));
  }
  if (const auto skipped = scans.value("skipped", std::uint64_t{0})) text += fmt::format(", {} skipped", skipped);
  text += '\n';
  text += empty_line(scans);
  if (scans.contains("last_error") && scans["last_error"].is_object()) {
    text += "last error  " + text_of(scans["last_error"], "message") + "\n";
  }
  return text;
}

std::string duration_line(const std::string& name, const json& duration) {
  return fmt::format("  {:<20}{:>9.1f}{:>9.1f}{:>9.1f}\n", name, duration.value("last", 0.0),
                     duration.value("mean", 0.0), duration.value("longest", 0.0));
}

std::string times_table(const json& scans) {
  std::string text = fmt::format("  {:<20}{:>9}{:>9}{:>9}\n", "ms", "last", "mean", "longest");
  text += duration_line("capture", scans.value("capture_ms", json::object()));
  text += duration_line("decode", scans.value("decode_ms", json::object()));
  text += duration_line("latency", scans.value("latency_ms", json::object()));
  const json stages = scans.value("stages_ms", json::object());
  for (const auto& [stage, duration] : stages.items()) {
    text += duration_line("  " + printable(stage), duration);
  }
  return text;
}

/// @param what  "regions", or "rules" that decided on regions
std::string counts_table(const json& scans, const std::string& what) {
  const json last = scans.value(what + "_of_last", json::object());
  const json all = scans.value(what, json::object());
  if (all.empty()) return "";  // an older service has none
  std::string text = fmt::format("  {:<24}{:>9}{:>14}\n", what, "last", "all");
  for (const auto& [status, count] : all.items()) {
    if (count == 0) continue;
    text += fmt::format("  {:<24}{:>9}{:>14}\n", printable(status), last.value(status, 0), count.get<std::uint64_t>());
  }
  return text;
}

/// Advises how to find a service that does not answer: other sockets in the same folder belong to other instances.
std::string way_to_service(const std::filesystem::path& socket) {
  std::string others;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(socket.parent_path(), error)) {
    if (!entry.is_socket(error) || entry.path() == socket) continue;
    others += (others.empty() ? "" : ", ") + printable(entry.path().string(), 200);
  }
  return "no service answers there: start it (sudo systemctl start slsd), or name its socket with --socket or "
         "SLSD_SOCKET" +
         (others.empty() ? "" : "; there are " + others);
}

}  // namespace

int report(const ClientOptions& options, const Failure& failure) {
  if (options.json) {
    words(options) << to_line({{"error", failure.error.to_json()}}) << std::flush;
  } else {
    const std::string where = failure.error.where.empty() ? "" : failure.error.where + ": ";
    const bool none = failure.exit_status == kNoDaemon;
    const std::string message = none ? way_to_service(options.socket) : failure.error.message;
    std::cerr << "slsctl: " << printable(where + message, kLongestText) << "\n";
  }
  return failure.exit_status;
}

std::string status_table(const json& status) {
  const json scans = status.value("scans", json::object());
  std::string text = fmt::format(
      "slsd {}   {}, up {:.0f} s, {} client(s), {} subscriber(s), {:.1f} MiB\n", text_of(status, "version"),
      status.value("ready", false) ? "ready to scan" : "not ready to scan", status.value("uptime_s", 0.0),
      status.value("clients", 0), status.value("subscribers", 0), status.value("resident_bytes", 0.0) / (1024 * 1024));
  const std::string calibration = text_of(status, "calibration");
  text += "calibration " + (calibration.empty() ? "none" : calibration) + "\n";
  if (const auto dropped = status.value("log_lines_dropped", std::uint64_t{0})) {
    text += fmt::format("log         {} lines were dropped: nothing read them in time\n", dropped);
  }
  text += device_line(status.value("projector", json::object()));
  for (const json& camera : status.value("cameras", json::array())) text += device_line(camera);
  return text + scans_lines(scans) + times_table(scans) + counts_table(scans, "regions") + counts_table(scans, "rules");
}

std::string reason_lines(const json& scan) {
  std::string text;
  for (const json& reason : scan.value("reasons", json::array())) {
    text += fmt::format("{:>6} {}{}: {} {}\n", reason.value("regions", 0),
                        reason.value("kind", "") == "guards" ? "recovery prevented, " : "", text_of(reason, "rule"),
                        text_of(reason, "meaning"), text_of(reason, "remedy"));
  }
  return text;
}

std::string scan_line(const json& scan) {
  std::uint64_t regions = 0;
  const json by_status = scan.value("regions", json::object());
  for (const auto& [status, count] : by_status.items()) regions += count.get<std::uint64_t>();
  std::string line =
      fmt::format("scan {}: {} points of {} regions, capture {:.1f} ms, decode {:.1f} ms, latency {:.1f} ms",
                  text_of(scan, "scan"), scan.value("points", 0), regions, scan.value("capture_ms", 0.0),
                  scan.value("decode_ms", 0.0), scan.value("latency_ms", 0.0));
  if (scan.contains("saturated")) line += fmt::format(", {} saturated", scan.value("saturated", 0));
  if (scan.contains("unseen"))
    line += fmt::format(", {} of unknown colour: no texture camera sees them", scan.value("unseen", 0));
  const json balances = scan.value("white_balance", json::object());
  for (const auto& [camera, factors] : balances.items())
    line += fmt::format("\ncamera {}: white_balance = {} would make the mean grey", printable(camera), factors.dump());
  return line;
}

std::string empty_line(const json& scan) {
  constexpr std::size_t kLongestReason = 1000;
  if (!scan.contains("empty") || !scan["empty"].is_string()) return {};
  return "no points: " + printable(scan["empty"].get<std::string>(), kLongestReason) + "\n";
}

}  // namespace slsd
