// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/service/commands.hpp"

#include <iostream>

#include "core/code/pattern.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "daemon/service/camera_list.hpp"
#include "daemon/service/monitor_list.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
using std::filesystem::path;

Result<> write_pattern_image(const std::optional<path>& configuration_file, const path& image) {
  const auto configuration = load_configuration_or_defaults(configuration_file);
  if (!configuration) return tl::unexpected(configuration.error());
  const auto pattern = configured_pattern(*configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  const auto png = encode_png(draw_pattern(*pattern));
  if (!png) return tl::unexpected(png.error());
  return write_file_atomically(image, *png);
}

Result<> list_devices(const std::optional<path>& configuration_file, bool as_json) {
  const auto configuration = load_configuration_or_defaults(configuration_file);
  if (!configuration) return tl::unexpected(configuration.error());
  const CameraList cameras = CameraList::look(*configuration);
  const MonitorList monitors = MonitorList::look();
  if (as_json) {
    nlohmann::json devices = cameras.json();
    devices["monitors"] = monitors.json();
    std::cout << devices.dump(2) << "\n";
    return {};
  }
  const ProjectorOptions& projector = configuration->projector;
  std::cout << "projector: driver " << to_string(projector.driver) << ", " << projector.width_px << "x"
            << projector.height_px << " px\n"
            << monitors.text() << cameras.text();
  return {};
}

}  // namespace slsd
