// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/report_json.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <vector>

#include "core/printable.hpp"
#include "daemon/rpc/message.hpp"
#include "daemon/scan/scan_statistics.hpp"

namespace slsd {
namespace {

using nlohmann::json;

double milliseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

template <class Counts>
json regions_json(const Counts& counts) {
  json regions = json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    regions[std::string(to_string(static_cast<RegionStatus>(i)))] = counts[i];
  }
  return regions;
}

/// Of the rules that decided on a region.
template <class Counts>
json rules_json(const Counts& counts) {
  json rules = json::object();
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (counts[i] > 0) rules[std::string(to_string(decode_rule(i)))] = counts[i];
  return rules;
}

json duration_json(const Duration& duration) {
  return {{"last", milliseconds(duration.last)},
          {"mean", milliseconds(duration.mean())},
          {"longest", milliseconds(duration.longest)}};
}

std::string stage_name(std::size_t index) {
  return std::string(to_string(static_cast<Stage>(index)));
}

json totals_json(const ScanTotals& totals) {
  json failed = json::object();
  for (const auto& [code, count] : totals.failed) failed[std::string(to_string(code))] = count;
  json stages = json::object();
  for (std::size_t i = 0; i < totals.stages.size(); ++i) stages[stage_name(i)] = duration_json(totals.stages[i]);
  json result{{"succeeded", totals.succeeded},
              {"failed", std::move(failed)},
              {"skipped", totals.skipped},
              {"points_of_last", totals.points},
              {"regions", regions_json(totals.regions)},
              {"regions_of_last", regions_json(totals.regions_of_last)},
              {"rules", rules_json(totals.rules)},
              {"rules_of_last", rules_json(totals.rules_of_last)},
              {"capture_ms", duration_json(totals.capture)},
              {"decode_ms", duration_json(totals.decode)},
              {"latency_ms", duration_json(totals.latency)},
              {"stages_ms", std::move(stages)}};
  result["empty"] = totals.empty.empty() ? json() : json(totals.empty);
  result["last_error"] = totals.last_error ? rpc_error(*totals.last_error).to_json() : json();
  return result;
}

// ---- settings ----

json camera_json(const CameraOptions& camera) {
  json about{{"name", camera.name()}, {"driver", camera.driver()}};
  if (const auto exposure_us = camera.exposure_us()) about["exposure_us"] = *exposure_us;
  if (const auto gain_db = camera.gain_db()) about["gain_db"] = *gain_db;
  if (!camera.replays()) about["format"] = camera.format();
  return about;
}

// ---- status ----

constexpr std::size_t kMaxProblemBytes = 1000;  // as an error's: it may quote what a device says of itself

json device_json(const DeviceStatus& device) {
  return {{"name", device.name},
          {"driver", device.driver},
          {"device", printable(device.device)},
          {"width_px", device.width_px},
          {"height_px", device.height_px},
          {"state", to_string(device.state)},
          {"problem", printable(device.problem, kMaxProblemBytes)},
          {"opened", device.opened},
          {"hardware", printable(device.hardware)}};
}

json drift_json(const DriftState& drift) {
  json result{{"epipolar_px", drift.epipolar_px}, {"limit_px", drift.limit_px}, {"scans", drift.scans}};
  result["off_since_scan"] = drift.off_since_scan ? json(*drift.off_since_scan) : json();
  return result;
}

/// @param drift  nothing before the first scan
json camera_status_json(const DeviceStatus& camera, const DriftState* drift) {
  json result = device_json(camera);
  result["calibration"] = drift != nullptr ? drift_json(*drift) : json();
  result["frames"] = camera.frames;
  result["frames_lost"] = camera.frames_lost;
  return result;
}

json projector_status_json(const DeviceStatus& projector) {
  json result = device_json(projector);
  result["shows"] = projector.shows;
  return result;
}

json pattern_json(const Configuration& configuration) {
  if (!configuration.pattern_file.empty()) return {{"file", configuration.pattern_file.string()}};
  const PatternOptions& pattern = configuration.pattern;
  return {{"symbol_size_px", pattern.symbol_size_px},
          {"spacing_px", pattern.spacing_px},
          {"symbols", pattern.symbols},
          {"seed", pattern.seed}};
}

json black_box_json(const ServiceState& state) {
  const BlackBox& box = state.scanner.black_box();
  return {{"held_bytes", box.bytes()}, {"limit_bytes", box.bytes_max()}, {"bundles_written", state.bundles_written()}};
}

json memory_json(const MemoryBudget& memory) {
  return {{"held_bytes", memory.held()}, {"lent_bytes", memory.lent()}, {"limit_bytes", memory.limit()}};
}

}  // namespace

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total_pages = 0;
  std::uint64_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

bool is_ready(const ServiceState& state) {
  const RigStatus rig = state.scanner.rig().status();
  const bool open = is_open(rig.projector.state) &&
                    std::ranges::all_of(rig.cameras, [](const DeviceStatus& camera) { return is_open(camera.state); });
  return open && !rig.cameras.empty() && !state.configuration.calibration_file.empty();
}

double latency_ms(MonotonicTime received) {
  return milliseconds(std::chrono::steady_clock::now() - received);
}

namespace {

double rounded(double value) {
  return std::round(1e4 * value) / 1e4;
}

void add_pixels(const DenseCloud& dense, const ScanResult& scan, json& result) {
  result["density"] = to_string(Density::kPixels);
  result["width_px"] = dense.views.front().map.width;
  result["height_px"] = dense.views.front().map.height;
  result["points"] = dense.points();
  result["dense_ms"] = milliseconds(scan.dense_time);
  if (scan.dense_saturated) result["saturated"] = *scan.dense_saturated;
  json pixels = json::object();
  for (int i = 0; i < kDensePixelCount; ++i) {
    std::uint64_t count = 0;
    for (const DenseView& view : dense.views) count += view.map.counts[static_cast<std::size_t>(i)];
    pixels[std::string(to_string(static_cast<DensePixel>(i)))] = count;
  }
  result["pixels"] = std::move(pixels);
  json epipolar = json::array();
  double white_differs = 0;
  for (const DenseView& view : dense.views) {
    epipolar.push_back(rounded(view.epipolar_px));
    white_differs = std::max(white_differs, view.white_differs);
  }
  result["epipolar_px"] = std::move(epipolar);
  if (scan.dense_saturated) result["white_differs"] = rounded(white_differs);
  if (dense.points() > 0) return;
  result["empty"] = !scan.empty.empty()
                        ? scan.empty
                        : "symbols were decoded, but around none the surface fits the pattern within the working "
                          "range: \"pixels\" has the reasons; look at depth_min_mm, depth_max_mm and the calibration";
}

}  // namespace

json scan_json(const ScanResult& scan, Density density) {
  json stages = json::object();
  for (std::size_t i = 0; i < scan.stage_times.size(); ++i) stages[stage_name(i)] = milliseconds(scan.stage_times[i]);
  json result{{"scan", scan.cloud.scan_id},
              {"time", scan.cloud.time},
              {"frame", scan.cloud.frame},
              {"points", scan.cloud.points.size()},
              {"regions", regions_json(scan.regions)},
              {"rules", rules_json(scan.rules)},
              {"received_monotonic_us",
               std::chrono::duration_cast<std::chrono::microseconds>(scan.received.time_since_epoch()).count()},
              {"skipped", scan.skipped},
              {"skew_ms", milliseconds(scan.skew)},
              {"capture_ms", milliseconds(scan.capture_time)},
              {"decode_ms", milliseconds(scan.decode_time)},
              {"stages_ms", std::move(stages)}};
  if (scan.cloud.sigma_calibration_mm) result["sigma_calibration_mm"] = *scan.cloud.sigma_calibration_mm;
  if (scan.saturated) result["saturated"] = *scan.saturated;
  if (density == Density::kPixels && scan.dense) {
    add_pixels(*scan.dense, scan, result);
  } else if (!scan.empty.empty()) {
    result["empty"] = scan.empty;
  }
  result["tries"] = scan.lost.count + 1;
  if (scan.lost.count > 0) {
    json lost = json::array();
    for (const Error& error : scan.lost.last) lost.push_back(rpc_error(error).to_json());
    result["lost_tries"] = std::move(lost);
  }
  return result;
}

json reasons_json(const ScanResult& scan) {
  std::vector<DecodeRule> rules;
  const auto count = [&](DecodeRule rule) { return scan.rules[static_cast<std::size_t>(rule)]; };
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
    if (scan.rules[i] > 0 && text_of(decode_rule(i)).kind != RuleKind::kAccepts) rules.push_back(decode_rule(i));
  std::ranges::stable_sort(rules, std::greater(), count);
  json reasons = json::array();
  for (const DecodeRule rule : rules) {
    const RuleText& text = text_of(rule);
    json reason{{"rule", text.name},      {"number", number_of(rule)}, {"kind", to_string(text.kind)},
                {"regions", count(rule)}, {"meaning", text.meaning},   {"remedy", text.remedy}};
    if (text.kind == RuleKind::kRejects) reason["status"] = to_string(text.gives);
    reasons.push_back(std::move(reason));
  }
  return reasons;
}

json frame_json(const FrameImage& frame) {
  json result{{"width_px", frame.width_px},
              {"height_px", frame.height_px},
              {"bits", frame.bits},
              {"frame", frame.sequence},
              {"exposure_start_ns", frame.exposure_start.time_since_epoch().count()},
              {"received_ns", frame.received.time_since_epoch().count()}};
  if (!frame.camera.empty()) result["camera"] = frame.camera;
  return result;
}

json settings_json(const Configuration& configuration) {
  const ProjectorOptions& projector = configuration.projector;
  json cameras = json::array();
  for (const CameraOptions& camera : configuration.cameras) {
    cameras.push_back(camera_json(camera));
  }
  return {
      {"version", SLSD_VERSION},
      {"projector",
       {{"width_px", projector.width_px}, {"height_px", projector.height_px}, {"refresh_hz", projector.refresh_hz}}},
      {"power_line_hz", configuration.scan.power_line_hz},
      {"cameras", std::move(cameras)},
      {"configuration", configuration.given}};
}

json status_json(const ServiceState& state) {
  const Rig& rig = state.scanner.rig();
  json cameras = json::array();
  const std::vector<DriftState> drifts = state.scanner.drifts();
  for (const DeviceStatus& camera : rig.camera_statuses()) {
    cameras.push_back(camera_status_json(camera, cameras.size() < drifts.size() ? &drifts[cameras.size()] : nullptr));
  }
  const auto uptime = std::chrono::duration<double>(std::chrono::steady_clock::now() - state.started);
  return {{"version", SLSD_VERSION},
          {"process", ::getpid()},
          {"uptime_s", uptime.count()},
          {"ready", is_ready(state)},
          {"calibrating", state.calibration && state.calibration->under_way()},
          {"resident_bytes", resident_bytes()},
          {"log_lines_dropped", state.log_lines_dropped()},
          {"clients", state.server->clients()},
          {"clients_dropped", state.server->dropped()},
          {"subscribers", state.server->subscribers()},
          {"clients_memory", memory_json(state.server->memory())},
          {"black_box", black_box_json(state)},
          {"configuration", state.configuration_file.string()},
          {"calibration", state.configuration.calibration_file.string()},
          {"pattern", pattern_json(state.configuration)},
          {"projector", projector_status_json(rig.projector_status())},
          {"cameras", std::move(cameras)},
          {"scans", totals_json(state.scanner.totals())}};
}

}  // namespace slsd
