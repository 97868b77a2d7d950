// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <map>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/report.hpp"
#include "core/printable.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kCausesShown = 6;

/// One reading of the metrics: the value of each series, by its name and labels as in the text.
using Series = std::map<std::string, double, std::less<>>;

Series read_series(std::string_view text) {
  Series series;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t gap = line.rfind(' ');
    if (line.empty() || line.front() == '#' || gap == std::string_view::npos) continue;
    series.emplace(line.substr(0, gap), std::strtod(std::string(line.substr(gap + 1)).c_str(), nullptr));
  }
  return series;
}

/// The change of the metrics between two readings.
class Change {
 public:
  Change(const Series& before, const Series& now, double seconds) : before_(before), now_(now), seconds_(seconds) {}

  [[nodiscard]] double value(const std::string& series) const {
    const auto found = now_.find(series);
    return found == now_.end() ? 0 : found->second;
  }
  /// The growth of a counter; its whole value if it was reset.
  [[nodiscard]] double grown(const std::string& series) const {
    const auto found = before_.find(series);
    const double now = value(series), was = found == before_.end() ? 0 : found->second;
    return now >= was ? now - was : now;
  }
  [[nodiscard]] double rate(const std::string& series) const { return grown(series) / seconds_; }
  /// All series of a family with this beginning, by the rest of the name.
  [[nodiscard]] std::vector<std::pair<std::string, double>> grown_by(const std::string& begin) const {
    std::vector<std::pair<std::string, double>> parts;
    for (auto at = now_.lower_bound(begin); at != now_.end() && at->first.starts_with(begin); ++at)
      parts.emplace_back(at->first.substr(begin.size()), grown(at->first));
    return parts;
  }
  [[nodiscard]] double rate_of_all(const std::string& begin) const {
    double sum = 0;
    for (const auto& [rest, grew] : grown_by(begin)) sum += grew;
    return sum / seconds_;
  }
  /// The mean of a histogram's new values, in milliseconds; NaN if there are none.
  [[nodiscard]] double mean_ms(const std::string& family, const std::string& labels) const {
    const std::string of = labels.empty() ? "" : "{" + labels + "}";
    const double count = grown(family + "_count" + of);
    return count > 0 ? 1000 * grown(family + "_sum" + of) / count : kNone;
  }
  /// The quantile of a histogram's new values, in milliseconds, interpolated within the bucket; NaN if there are none.
  [[nodiscard]] double quantile_ms(const std::string& family, const std::string& labels, double part) const {
    std::vector<std::pair<double, double>> buckets;
    const std::string begin = family + "_bucket{" + (labels.empty() ? "" : labels + ",") + "le=\"";
    for (const auto& [bound, below] : grown_by(begin)) buckets.emplace_back(std::strtod(bound.c_str(), nullptr), below);
    std::ranges::sort(buckets);
    if (buckets.empty() || buckets.back().second <= 0) return kNone;
    const double wanted = part * buckets.back().second;
    double low = 0, counted = 0;
    for (const auto& [bound, below] : buckets) {
      if (below >= wanted && std::isinf(bound)) return 1000 * low;  // beyond the last finite bound
      if (below >= wanted) return 1000 * (low + (bound - low) * (wanted - counted) / (below - counted));
      low = bound, counted = below;
    }
    return kNone;
  }

 private:
  const Series& before_;
  const Series& now_;
  double seconds_;
};

std::string figure(double ms) {
  return std::isnan(ms) ? fmt::format("{:>9}", "-") : fmt::format("{:>9.1f}", ms);
}

std::string time_line(const Change& change, const std::string& name, const std::string& family,
                      const std::string& labels = {}) {
  return fmt::format("  {:<20}{}{}{}\n", name, figure(change.mean_ms(family, labels)),
                     figure(change.quantile_ms(family, labels, 0.5)), figure(change.quantile_ms(family, labels, 0.95)));
}

/// The largest few shares of this interval: "decoded 95.0 %, no_neighbour 3.1 %".
std::string shares(const Change& change, const std::string& begin) {
  auto parts = change.grown_by(begin);
  double sum = 0;
  for (const auto& [name, grew] : parts) sum += grew;
  std::ranges::sort(parts, [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (std::size_t i = 0; sum > 0 && i < std::min(parts.size(), kCausesShown); ++i) {
    if (parts[i].second <= 0) break;
    text += fmt::format("{}{} {:.1f} %", text.empty() ? "" : ", ", parts[i].first.substr(0, parts[i].first.find('"')),
                        100 * parts[i].second / sum);
  }
  return text.empty() ? "-" : text;
}

std::string device_lines(const json& device, const std::string& rates) {
  const std::string problem = printable(device.value("problem", ""), 1000);
  return fmt::format("{:<12}{}{}\n", printable(device.value("name", "")), device.value("state", ""), rates) +
         (problem.empty() ? "" : "            " + problem + "\n");
}

std::string camera_lines(const json& camera, const Change& change) {
  std::string name;  // as in the label
  for (const char letter : camera.value("name", ""))
    name += (letter == '\\' || letter == '"' ? std::string(1, '\\') : std::string()) + letter;
  const std::string label = "{camera=\"" + name + "\"";
  std::string rates = fmt::format(", {:.1f} frames/s", change.rate("slsd_camera_frames_total" + label + "}"));
  for (const auto& [cause, grew] : change.grown_by("slsd_camera_frames_lost_total" + label + ",cause=\"")) {
    if (grew > 0) rates += fmt::format(", {:.0f} lost ({})", grew, cause.substr(0, cause.find('"')));
  }
  if (change.value("slsd_camera_knocked" + label + "}") > 0) rates += ", knocked out of its calibration";
  return device_lines(camera, rates);
}

std::string screen(const json& status, const Change& change) {
  std::string text = fmt::format(
      "slsd {}   {}, up {:.0f} s, {:.1f} MiB, {} client(s), {} subscriber(s), {:.2f} MB/s sent\n"
      "scans       {:.2f}/s, {:.2f}/s failed, {:.2f}/s skipped, {:.2f}/s clouds lost by readers, {} points in the "
      "last\n",
      printable(status.value("version", "")), status.value("ready", false) ? "ready to scan" : "not ready to scan",
      status.value("uptime_s", 0.0), status.value("resident_bytes", 0.0) / (1024 * 1024), status.value("clients", 0),
      status.value("subscribers", 0), change.rate("slsd_sent_bytes_total") / 1e6,
      change.rate("slsd_scans_succeeded_total"), change.rate_of_all("slsd_scans_failed_total{"),
      change.rate("slsd_scans_skipped_total"), change.rate("slsd_clouds_lost_total"),
      change.value("slsd_points_of_last_scan"));
  text += device_lines(status.value("projector", json::object()),
                       ", shows " + printable(status.value("projector", json::object()).value("shows", "")));
  for (const json& camera : status.value("cameras", json::array())) text += camera_lines(camera, change);
  text += "regions     " + shares(change, "slsd_regions_total{status=\"") + "\n";
  if (change.rate_of_all("slsd_pixels_total{") > 0)
    text += "pixels      " + shares(change, "slsd_pixels_total{status=\"") + "\n";
  text += fmt::format("  {:<20}{:>9}{:>9}{:>9}\n", "ms", "mean", "half", "95 %");
  text += time_line(change, "capture", "slsd_capture_seconds");
  text += time_line(change, "decode", "slsd_decode_seconds");
  text += time_line(change, "latency", "slsd_latency_seconds");
  for (const auto& [stage, rate] : change.grown_by("slsd_stage_seconds_count{stage=\"")) {
    const std::string name = stage.substr(0, stage.find('"'));
    text += time_line(change, "  " + printable(name), "slsd_stage_seconds", "stage=\"" + name + "\"");
  }
  return text;
}

json as_json(const Change& change, double seconds) {
  const auto times = [&](const std::string& family) -> json {
    const double mean = change.mean_ms(family, "");
    if (std::isnan(mean)) return nullptr;
    return {
        {"mean", mean}, {"half", change.quantile_ms(family, "", 0.5)}, {"most", change.quantile_ms(family, "", 0.95)}};
  };
  return {{"seconds", seconds},
          {"scans_hz", change.rate("slsd_scans_succeeded_total")},
          {"failed_hz", change.rate_of_all("slsd_scans_failed_total{")},
          {"skipped_hz", change.rate("slsd_scans_skipped_total")},
          {"sent_bytes_hz", change.rate("slsd_sent_bytes_total")},
          {"capture_ms", times("slsd_capture_seconds")},
          {"decode_ms", times("slsd_decode_seconds")},
          {"latency_ms", times("slsd_latency_seconds")}};
}

}  // namespace

int top_command(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return report(options, failure(connection.error()));
  const bool live = ::isatty(STDOUT_FILENO) == 1;
  Series before;
  double uptime_before_s = 0;
  for (std::uint64_t looks = 0; options.count == 0 || looks < options.count; ++looks) {
    if (looks > 0) std::this_thread::sleep_for(std::chrono::duration<double>(options.interval_s));
    const auto status = ask(*connection, "status", json::object());
    if (!status) return report(options, status.error());
    const auto metrics = ask(*connection, "metrics", json::object());
    if (!metrics) return report(options, metrics.error());
    const json& told = status->reply.message["result"];
    Series now = read_series(metrics->reply.bytes);
    const double uptime_s = now["slsd_uptime_seconds"];
    // The first reading covers the whole time since the service started.
    const double seconds = std::max(uptime_s - uptime_before_s, 1e-3);
    const Change change(before, now, seconds);
    if (options.json) {
      std::cout << to_line(as_json(change, seconds)) << std::flush;
    } else {
      std::string text = screen(told, change);
      if (live) {  // overwrites the previous screen and clears the rest of each line and below
        for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 4)
          text.replace(at, 1, "\x1b[K\n");
        text = (looks == 0 ? "\x1b[2J\x1b[H" : "\x1b[H") + text + "\x1b[J";
      } else if (looks > 0) {
        text = "\n" + text;
      }
      std::cout << text << std::flush;
    }
    if (!std::cout) return kRequestFailed;
    before = std::move(now), uptime_before_s = uptime_s;
  }
  return kDone;
}

}  // namespace slsd
