// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/status_json.hpp"

#include <unistd.h>

#include <fstream>

#include "daemon/server/scan_json.hpp"

namespace slsd {
namespace {

using nlohmann::json;

json device_json(const DeviceStatus& device) {
  return {{"name", device.name},         {"driver", device.driver},       {"device", device.device},
          {"width_px", device.width_px}, {"height_px", device.height_px}, {"state", to_string(device.state)},
          {"problem", device.problem},   {"opened", device.opened},       {"hardware", device.hardware}};
}

json drift_json(const DriftState& drift) {
  json result{{"epipolar_px", drift.epipolar_px}, {"limit_px", drift.limit_px}, {"scans", drift.scans}};
  result["off_since_scan"] = drift.off_since_scan ? json(*drift.off_since_scan) : json();
  return result;
}

/// @param drift  nothing before the first scan
json camera_json(const DeviceStatus& camera, const DriftState* drift) {
  json result = device_json(camera);
  result["calibration"] = drift != nullptr ? drift_json(*drift) : json();
  result["frames"] = camera.frames;
  result["frames_lost"] = camera.frames_lost;
  return result;
}

json projector_json(const DeviceStatus& projector) {
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

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total_pages = 0;
  std::uint64_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

json status_json(const ServiceState& state) {
  const Rig& rig = state.scanner.rig();
  json cameras = json::array();
  bool ready = is_open(rig.projector_status().state) && !state.configuration.calibration_file.empty();
  const std::vector<DriftState> drifts = state.scanner.drifts();
  for (const DeviceStatus& camera : rig.camera_statuses()) {
    cameras.push_back(camera_json(camera, cameras.size() < drifts.size() ? &drifts[cameras.size()] : nullptr));
    ready = ready && is_open(camera.state);
  }
  const auto uptime = std::chrono::duration<double>(std::chrono::steady_clock::now() - state.started);
  return {{"version", SLSD_VERSION},
          {"process", ::getpid()},
          {"uptime_s", uptime.count()},
          {"ready", ready && !cameras.empty()},
          {"resident_bytes", resident_bytes()},
          {"log_lines_dropped", state.log_lines_dropped()},
          {"clients", state.server->clients()},
          {"subscribers", state.server->subscribers()},
          {"configuration", state.configuration_file.string()},
          {"calibration", state.configuration.calibration_file.string()},
          {"pattern", pattern_json(state.configuration)},
          {"projector", projector_json(rig.projector_status())},
          {"cameras", std::move(cameras)},
          {"scans", totals_json(state.scanner.totals())}};
}

}  // namespace slsd
