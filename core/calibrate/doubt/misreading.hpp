// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/geometry/calibration.hpp"

namespace slsd {

/// One camera of a calibration, with its projector.
struct CameraRig {
  CalibratedCamera camera;
  Lens projector;
};

/// Another convention in which a calibration may have been written.
struct Misreading {
  std::string advice;  ///< likely cause and remedy: "T looks like metres: multiply it by 1000"
  double log_prior;    ///< the natural logarithm of how often this is met
  CameraRig rig;       ///< the rig in that convention
};

/// Every convention that is tried: units of T, directions of R and T, axes, matrices swapped or of another image size.
/// @thread reentrant
[[nodiscard]] std::vector<Misreading> misreadings_of(const CameraRig& rig);

}  // namespace slsd
