// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/hand_eye/hand_eye_model.hpp"

namespace slsd {

/// Residual of one view: the board by the robot minus the board by the cameras, as in LocatedBoard.
struct ViewResidual {
  Eigen::Vector3d turn_rad;
  Eigen::Vector3d shift_mm;
};

/// A model of a session, fitted.
struct HandEyeFit {
  HandEyePlaces places;
  std::optional<RigidTransform> mount_from_rig_after, stand_from_board_after;  ///< if the model lets them move
  std::vector<double> lateness;  ///< share of the way to a view that its pose had still to go; if the model is late
  std::vector<ViewResidual> residuals;  ///< one for each view, also for those left out
  Eigen::VectorXd shared;               ///< the shared errors as adjusted: add them to what was assumed
  RobotNoise noise;
  /// Logarithm of the probability density of the pictures, given the robot's poses and the model. Models of the same
  /// pictures compare by it.
  double evidence = 0;
  /// Covariance of turn (rad) and place (mm) of mount_from_rig, along the axes of the mount, and then of
  /// stand_from_board, along the axes of the stand. Given the estimated noise.
  Eigen::Matrix<double, 12, 12> covariance;
  double freedom = 0;  ///< degrees of freedom behind that covariance's scale
};

/// Adjusts the places of scanner and board, the shared errors and the model's own unknowns at once. Each view has the
/// errors of its corners and of the robot's pose; the robot's noise is estimated by restricted maximum likelihood
/// (Patterson and Thompson 1971), starting from what a robot usually has. The evidence is Laplace's approximation.
/// @param session  at least 3 views that are not left out; with a move, at least one view before and after it
/// @thread reentrant
[[nodiscard]] HandEyeFit fit_hand_eye(const HandEyeSession& session, const HandEyeModel& model = {});

}  // namespace slsd
