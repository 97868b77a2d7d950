// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/settings_json.hpp"

namespace slsd {

using nlohmann::json;

namespace {

json camera_json(const CameraOptions& camera) {
  json about{{"name", camera.name()}, {"driver", camera.driver()}};
  if (const auto exposure_us = camera.exposure_us()) about["exposure_us"] = *exposure_us;
  if (const auto gain_db = camera.gain_db()) about["gain_db"] = *gain_db;
  if (!camera.replays()) about["format"] = camera.format();
  return about;
}

}  // namespace

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

}  // namespace slsd
