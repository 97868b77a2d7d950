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
  double depth_min_mm = 400;  ///< the working range, for which the depth's uncertainty is predicted
  double depth_max_mm = 2500;
  Eigen::AlignedBox2d sheet_mm;  ///< the board with its white border, in the board's frame; empty: the part that is
                                 ///< seen
};

/// Calibrates cameras and projector together by Zhang's method. The projector follows from the points at which the
/// cameras' rays to its pixels meet the board. Then one adjustment covers everything; distortion terms count only as
/// far as the poses determine them. Contradicting poses and outlying points are left out and reported.
///
/// Views of a reference plane (Elahi et al. 2020) add a second step. The first step leaves them out. In the second
/// step, the calibration so far measures each view, and everything is adjusted again with the views among the poses.
/// @errors kImpossible: the observations do not determine the rig; the message says which poses to add
/// @thread reentrant
[[nodiscard]] Result<CalibrationOutcome> calibrate(Observations observations, const CalibrateOptions& options);

}  // namespace slsd
