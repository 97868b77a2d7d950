// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/calibrate/solve/bundle.hpp"
#include "core/calibrate/solve/pose_influence.hpp"

namespace slsd {

/// Uncertainty of a measured depth at a distance: root mean square over the field of the first camera.
struct DepthUncertainty {
  double depth_mm = 0;
  double calibration_mm = 0;  ///< one standard deviation, from the uncertainty of the calibration
  double noise_mm = 0;        ///< one standard deviation of one symbol's depth, from the noise of its centre
};

/// Propagates the parameters' covariance to the depth of points that the first camera and the projector both see.
/// @param symbol_sigma_px  one standard deviation of a symbol's centre in x and in y
/// @return one for each depth, without depths at which no point is seen by both
/// @thread reentrant
[[nodiscard]] std::vector<DepthUncertainty> depth_uncertainty(const RigModel& rig,
                                                              const std::vector<SharedParameter>& shared,
                                                              const PoseInfluence& influence, double symbol_sigma_px,
                                                              const std::vector<double>& depths_mm);

}  // namespace slsd
