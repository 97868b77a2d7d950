// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>

#include "core/hand_eye/fit_hand_eye.hpp"

namespace slsd {

/// A pose that a session lacks.
struct NextPose {
  RigidTransform base_from_flange;
  double error_mm = 0;   ///< HandEyeVerdict::error_mm that is expected with it
  std::size_t from = 0;  ///< the view whose pose turns least into it
  Eigen::Vector3d axis;  ///< of the turn from that pose, in the flange
  double turn_rad = 0;   ///< of that turn, at least 0
  double move_mm = 0;    ///< of the flange from that pose
};

/// Proposes the pose that shrinks the error at the working distance most: the board in the middle of the picture, at
/// one of a few distances, tilts and rolls. Each candidate is adjusted with the views so far, as if it were taken.
/// Tells nothing of what the arm can reach.
/// @param fit  of this session, with what its model leaves out
/// @return     nothing if no candidate shows most of the board
/// @thread     reentrant
[[nodiscard]] std::optional<NextPose> propose_pose(const HandEyeSession& session, const HandEyeFit& fit,
                                                   const Calibration& calibration, const Board& board,
                                                   double working_distance_mm);

/// Describes it: "from pose_03, turn the flange by 31° about (0.9, 0.1, -0.4) and move it by 210 mm".
[[nodiscard]] std::string describe(const NextPose& next, const HandEyeSession& session);

}  // namespace slsd
