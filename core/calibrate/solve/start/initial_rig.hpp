// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/calibrate/judge/pose_faults.hpp"
#include "core/calibrate/solve/rig_model.hpp"
#include "core/result.hpp"

namespace slsd {

struct InitialRig {
  RigModel rig;                    ///< has a pose for each of the observations
  std::vector<FaultyPose> faulty;  ///< ascending: poses that no camera can have seen; their places in the rig are
                                   ///< undefined
};

/// A first estimate of the cameras and of the board's poses. Zhang's method (2000) gives the focal lengths, with the
/// principal points at the centre and no distortion; then each pose follows from its plane.
///
/// One wholly wrong pose (a skewed or mirrored picture, another board) can pull Zhang's estimate far off. The
/// adjustment then ends in a wrong local minimum. Other poses then seem wrong. So the estimate is compared with the
/// focal length that fits most of the views, and poses far off are judged by the rest.
/// @errors kImpossible: too few poses, or all of them parallel; the message says which to add
/// @thread reentrant
[[nodiscard]] Result<InitialRig> estimate_cameras(const Observations& observations);

[[nodiscard]] FaultyPose fits_no_plane(std::size_t pose);

/// Checks that the poses differ in tilt. Poses that all face one way fit any focal length, which then follows the
/// noise.
/// @param rig  cameras and poses, adjusted to what the cameras saw
/// @errors kImpossible: no two of its poses differ enough; the message says which to add
/// @thread reentrant
[[nodiscard]] Result<> check_tilts(const RigModel& rig);

/// A first estimate of one more pose, by the first camera that sees enough of it.
/// @param rig  a calibrated rig
/// @return     rig from board; empty if the corners fit no plane
/// @thread reentrant
[[nodiscard]] std::optional<MotionVector> estimate_pose(const PoseObservation& pose, const RigModel& rig);

/// A first estimate of the projector by the direct linear transformation, from the points at which the cameras' rays to
/// its pixels meet the board. It is robust against wrong pixels, and against wrong poses as long as most poses are
/// right.
/// @param rig  in: cameras and poses; out: the projector too
/// @return     ascending: the poses that are far off, which would pull an adjustment to a wrong minimum; empty if too
///             few others are left
/// @errors kImpossible
/// @thread reentrant
[[nodiscard]] Result<std::vector<std::size_t>> estimate_projector(const Observations& observations, RigModel& rig);

}  // namespace slsd
