// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// Residuals of one view, camera px: the model's prediction of each point minus its observation, including outlying
/// points. Infinite for a symbol whose rays miss the board's shape.
struct ViewResiduals {
  std::vector<Eigen::Vector2d> corners_px;
  std::vector<Eigen::Vector2d> symbols_px;
  std::vector<Eigen::Vector2d> symbols_projector_px;  ///< the same in the projector: the image of the camera's point
};

/// @thread reentrant
[[nodiscard]] ViewResiduals residuals_of(const PoseView& view, const RigModel& rig, const MotionVector& rig_from_board,
                                         PoseSubject subject = PoseSubject::kBoard);

/// Root mean square of the lengths, as OpenCV computes it.
[[nodiscard]] double rms_px(const std::vector<Eigen::Vector2d>& residuals);
/// One standard deviation of a component, from the median, so that outliers have no influence.
[[nodiscard]] double robust_sigma_px(std::vector<double> components);

}  // namespace slsd
