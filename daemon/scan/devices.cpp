// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/devices.hpp"

#include "drivers/camera/aravis/aravis_camera.hpp"
#include "drivers/camera/faulty_camera.hpp"
#include "drivers/camera/file_camera.hpp"
#include "drivers/camera/v4l2/v4l2_camera.hpp"
#include "drivers/projector/glfw/glfw_projector.hpp"
#include "drivers/projector/headless_projector.hpp"

namespace slsd {

Result<std::unique_ptr<Camera>> make_camera(const CameraOptions& options) {
  std::unique_ptr<Camera> camera;
  switch (options.driver) {
    case CameraDriver::kFile:
      camera = std::make_unique<FileCamera>(options.file);
      break;
    case CameraDriver::kV4l2:
      camera = std::make_unique<V4l2Camera>(options.v4l2);
      break;
    case CameraDriver::kAravis:
      camera = std::make_unique<AravisCamera>(options.aravis);
      break;
  }
  if (!options.faults.empty()) camera = std::make_unique<FaultyCamera>(std::move(camera), options.faults);
  return camera;
}

Result<std::unique_ptr<Projector>> make_projector(const ProjectorOptions& options) {
  if (options.driver == ProjectorDriver::kGlfw) {
    return std::make_unique<GlfwProjector>(
        GlfwProjectorOptions{options.monitor, options.width_px, options.height_px, options.light});
  }
  HeadlessProjectorOptions headless;
  headless.width_px = options.width_px;
  headless.height_px = options.height_px;
  headless.light = options.light;
  if (options.refresh_hz > 0) headless.refresh_hz = options.refresh_hz;
  return std::make_unique<HeadlessProjector>(std::move(headless));
}

}  // namespace slsd
