// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// The projector and the cameras of a calibration session.
/// @thread thread-bound
class PoseSource {
 public:
  virtual ~PoseSource() = default;

  /// Names, in the order of the pictures; at least one.
  [[nodiscard]] virtual const std::vector<std::string>& cameras() const = 0;
  [[nodiscard]] virtual ImageSize projector() const = 0;

  /// Shows an image of the projector's size from now on. If the projector fails, grab() reports it.
  virtual void show(const Grey8& image) = 0;

  /// Takes a picture with each camera, exposed after the call while the image is visible.
  /// @errors kTimeout: a device is not ready; those of Rig::capture(). May be called again
  [[nodiscard]] virtual Result<std::vector<GreyImage>> grab() = 0;
};

}  // namespace slsd
