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
          {"problem", device.problem},   {"opened", device.opened}};
}

json camera_json(const DeviceStatus& camera) {
  json result = device_json(camera);
  result["frames"] = camera.frames;
  result["frames_lost"] = camera.frames_lost;
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
  bool ready = rig.projector_status().state == DeviceState::kReady && !state.configuration.calibration_file.empty();
  for (const DeviceStatus& camera : rig.camera_statuses()) {
    cameras.push_back(camera_json(camera));
    ready = ready && camera.state == DeviceState::kReady;
  }
  const auto uptime = std::chrono::duration<double>(std::chrono::steady_clock::now() - state.started);
  return {{"version", SLSD_VERSION},
          {"process", ::getpid()},
          {"uptime_s", uptime.count()},
          {"ready", ready && !cameras.empty()},
          {"resident_bytes", resident_bytes()},
          {"clients", state.server->clients()},
          {"subscribers", state.server->subscribers()},
          {"configuration", state.configuration_file.string()},
          {"calibration", state.configuration.calibration_file.string()},
          {"pattern", pattern_json(state.configuration)},
          {"projector", device_json(rig.projector_status())},
          {"cameras", std::move(cameras)},
          {"scans", totals_json(state.scanner.totals())}};
}

}  // namespace slsd
