// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/methods/status_json.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "core/duration.hpp"
#include "core/printable.hpp"
#include "daemon/scan/scan_statistics.hpp"
#include "daemon/server/methods/counts_json.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

json duration_json(const Duration& duration) {
  return {{"last", in_ms(duration.last)}, {"mean", in_ms(duration.mean())}, {"longest", in_ms(duration.longest)}};
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

constexpr std::size_t kMaxProblemBytes = 1000;  // as for errors: it may quote the device's own text

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

json camera_json(const CameraOptions& camera) {
  json about{{"name", camera.name()}, {"driver", camera.driver()}};
  if (const auto exposure_us = camera.exposure_us()) about["exposure_us"] = *exposure_us;
  if (!camera.exposures_us.empty()) about["exposures_us"] = camera.exposures_us;
  if (const auto gain_db = camera.gain_db()) about["gain_db"] = *gain_db;
  if (!camera.replays()) about["format"] = camera.format();
  if (!camera.measures()) about["use"] = "texture";
  return about;
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
