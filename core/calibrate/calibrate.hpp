// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Geometry>

#include "core/calibrate/judge/calibration_outcome.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/lens_terms.hpp"
#include "core/result.hpp"

namespace slsd {

struct CalibrateOptions {
  double depth_min_mm = 400;  ///< the working range, in which the depth's uncertainty is foretold
  double depth_max_mm = 2500;
  Eigen::AlignedBox2d sheet_mm;  ///< the board with its white border, in the board's frame; empty: what is seen of it
};

/// Calibrates cameras and projector together: Zhang's method, the projector by where the cameras' rays to its pixels
/// meet the board, then one adjustment of everything, in which terms of distortion take part only as far as the poses
/// determine them. Poses that contradict the others and points that lie off are left out and named.
///
/// Where there are looks at a reference plane (Elahi et al. 2020), that is the first step, without them. In the second
/// one each look is measured by the calibration so far, and then everything is adjusted again with the looks among the
/// poses.
/// @errors kImpossible: what was seen does not determine the rig; the message says what to shoot
/// @thread reentrant
[[nodiscard]] Result<CalibrationOutcome> calibrate(Observations observations, const CalibrateOptions& options);

}  // namespace slsd
