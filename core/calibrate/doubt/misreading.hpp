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
  double log_prior;    ///< natural logarithm of how common this is
  CameraRig rig;       ///< the rig in that convention
};

/// Every convention to try: units of T, directions of R and T, axes, matrices that are swapped or belong to another
/// image size.
/// @thread reentrant
[[nodiscard]] std::vector<Misreading> misreadings_of(const CameraRig& rig);

}  // namespace slsd
