// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// For a build without device drivers (SLSD_DEVICES=OFF): recorded frames, and a virtual projector.
#include <utility>

#include "daemon/scan/rig/devices.hpp"
#include "daemon/scan/rig/headless_options.hpp"
#include "drivers/camera/faulty_camera.hpp"
#include "drivers/camera/file_camera.hpp"

namespace slsd {
namespace {

tl::unexpected<Error> lacks(std::string_view driver) {
  return fail(ErrorCode::kUnsupported,
              "this slsd was built without the driver " + std::string(driver) + "; ./run build builds one that has it");
}

}  // namespace

Result<std::unique_ptr<Camera>> make_camera(const CameraOptions& options) {
  const auto* file = std::get_if<FileCameraOptions>(&options.of_driver);
  if (file == nullptr) return lacks(options.driver());
  std::unique_ptr<Camera> camera = std::make_unique<FileCamera>(*file);
  if (!options.faults.empty()) camera = std::make_unique<FaultyCamera>(std::move(camera), options.faults);
  return camera;
}

Result<std::unique_ptr<Projector>> make_projector(const ProjectorOptions& options) {
  if (options.driver != ProjectorDriver::kHeadless) return lacks("glfw");
  return std::make_unique<HeadlessProjector>(headless_options(options));
}

}  // namespace slsd
