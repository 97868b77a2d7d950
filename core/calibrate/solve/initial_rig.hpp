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
  std::vector<FaultyPose> faulty;  ///< ascending: poses that no camera can have seen; in the rig they lie anywhere
};

/// A first estimate of the cameras and of the board's poses: Zhang's method (2000) for the focal lengths, with the
/// principal points in the middle and no distortion; then each pose by its plane.
///
/// One pose that is wholly wrong (a skewed or mirrored picture, another board) draws Zhang's estimate to where the
/// adjustment ends in a neighbouring minimum, in which others seem to be the wrong ones. So the estimate is held
/// against the focal length that suits most of the views, and poses far off are judged by what the others give.
/// @errors kImpossible: too few poses, or all of them parallel, with what to shoot
/// @thread reentrant
[[nodiscard]] Result<InitialRig> estimate_cameras(const Observations& observations);

[[nodiscard]] FaultyPose fits_no_plane(std::size_t pose);

/// Poses that all face one way fit lenses of any focal length, which then follow the noise.
/// @param rig  cameras and poses, adjusted to what the cameras saw
/// @errors kImpossible: no two of its poses differ enough, with what to shoot
/// @thread reentrant
[[nodiscard]] Result<> check_tilts(const RigModel& rig);

/// A first estimate of one more pose, by the first camera that sees enough of it.
/// @param rig  calibrated
/// @return     rig from board; nothing where the corners fit no plane
/// @thread reentrant
[[nodiscard]] std::optional<MotionVector> estimate_pose(const PoseObservation& pose, const RigModel& rig);

/// A first estimate of the projector, from where the cameras' rays to its pixels meet the board: the direct linear
/// transformation, robust against wrong pixels, and against wrong poses as long as the others are most.
/// @param rig  in: cameras and poses; out: the projector too
/// @return     ascending: the poses that are far off it, which would draw an adjustment to where others seem to be the
///             wrong ones; none where too few others are left
/// @errors kImpossible
/// @thread reentrant
[[nodiscard]] Result<std::vector<std::size_t>> estimate_projector(const Observations& observations, RigModel& rig);

}  // namespace slsd
