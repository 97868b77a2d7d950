// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/service/commands.hpp"

#include <iostream>

#include "core/code/pattern.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/devices.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

// These commands serve before anything is configured: without any file the defaults hold.
Result<Configuration> configuration_or_defaults(const std::optional<path>& file) {
  if (file) return load_configuration(*file);
  std::error_code ignored;
  if (std::filesystem::exists(kConfigurationFile, ignored)) return load_configuration(kConfigurationFile);
  return read_configuration("", "defaults");
}

void list_camera(const CameraOptions& options) {
  std::cout << "camera \"" << options.name() << "\": driver " << to_string(options.driver);
  auto camera = make_camera(options);
  const Result<> opened = camera ? (*camera)->open() : Result<>(tl::unexpected(camera.error()));
  if (opened) {
    const CameraDescription& description = (*camera)->description();
    std::cout << ", " << description.device << ", " << description.width_px << "x" << description.height_px << " px\n";
  } else {
    std::cout << ", not available: " << to_string(opened.error()) << "\n";
  }
}

}  // namespace

Result<> write_pattern_image(const std::optional<path>& configuration_file, const path& image) {
  const auto configuration = configuration_or_defaults(configuration_file);
  if (!configuration) return tl::unexpected(configuration.error());
  const auto pattern = configured_pattern(*configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  const auto png = encode_png(draw_pattern(*pattern));
  if (!png) return tl::unexpected(png.error());
  return write_file_atomically(image, *png);
}

Result<> list_devices(const std::optional<path>& configuration_file) {
  const auto configuration = configuration_or_defaults(configuration_file);
  if (!configuration) return tl::unexpected(configuration.error());
  const ProjectorOptions& projector = configuration->projector;
  std::cout << "projector: driver headless, keeps the image in memory, any size (configured: "
            << to_string(projector.driver) << ", " << projector.width_px << "x" << projector.height_px << " px)\n";
  if (configuration->cameras.empty()) std::cout << "no camera is configured\n";
  for (const CameraOptions& camera : configuration->cameras) list_camera(camera);
  return {};
}

}  // namespace slsd
