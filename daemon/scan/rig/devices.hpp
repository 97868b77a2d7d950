// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>

#include "core/result.hpp"
#include "daemon/configuration/camera_options.hpp"
#include "daemon/configuration/projector_options.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// Makes the camera that the configuration names; it is not open yet.
/// @errors kUnsupported: this build lacks the driver
[[nodiscard]] Result<std::unique_ptr<Camera>> make_camera(const CameraOptions& options);

/// Makes the projector that the configuration names; it is not open yet.
[[nodiscard]] Result<std::unique_ptr<Projector>> make_projector(const ProjectorOptions& options);

}  // namespace slsd
