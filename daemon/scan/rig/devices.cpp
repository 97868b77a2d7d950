// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/devices.hpp"

#include "daemon/scan/rig/headless_options.hpp"
#include "drivers/camera/aravis/aravis_camera.hpp"
#include "drivers/camera/faulty_camera.hpp"
#include "drivers/camera/file_camera.hpp"
#include "drivers/camera/v4l2/v4l2_camera.hpp"
#include "drivers/projector/glfw/glfw_projector.hpp"
#include "drivers/projector/x11/x_display.hpp"

namespace slsd {

Result<std::unique_ptr<Camera>> make_camera(const CameraOptions& options) {
  using Made = std::unique_ptr<Camera>;
  auto camera = std::visit(
      Overloaded{[](const FileCameraOptions& file) -> Made { return std::make_unique<FileCamera>(file); },
                 [](const V4l2CameraOptions& v4l2) -> Made { return std::make_unique<V4l2Camera>(v4l2); },
                 [](const AravisCameraOptions& aravis) -> Made { return std::make_unique<AravisCamera>(aravis); }},
      options.of_driver);
  if (!options.faults.empty()) camera = std::make_unique<FaultyCamera>(std::move(camera), options.faults);
  return camera;
}

Result<std::unique_ptr<Projector>> make_projector(const ProjectorOptions& options) {
  if (options.driver == ProjectorDriver::kGlfw) {
    return std::make_unique<GlfwProjector>(GlfwProjectorOptions{
        .monitor = options.monitor,
        .width_px = options.width_px,
        .height_px = options.height_px,
        .light = options.light,
        .enable_output = options.enable_output.value_or(owns_display()),
        .refresh_hz = options.refresh_hz,
    });
  }
  return std::make_unique<HeadlessProjector>(headless_options(options));
}

}  // namespace slsd
