// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

#include "core/hand_eye/fit_hand_eye.hpp"

namespace slsd {

/// Judgement of a fit by what it means at the working distance.
struct HandEyeVerdict {
  double distance_mm = 0;  ///< the working distance
  double sigma_mm = 0;     ///< one standard deviation of a point's place there, in the worst direction
  double error_mm = 0;     ///< the worst direction of the 95 % ellipse of a point there
  double place_sigma_mm = 0, turn_sigma_rad = 0;  ///< of mount_from_rig, in the worst directions
};

enum class HandEyeGrade { kGood, kUsable, kBad };

inline constexpr double kGoodHandEyeMm = 1, kUsableHandEyeMm = 3;

[[nodiscard]] HandEyeVerdict judge_hand_eye(const HandEyeFit& fit, double distance_mm);
[[nodiscard]] HandEyeGrade grade(const HandEyeVerdict& verdict);
[[nodiscard]] std::string_view to_string(HandEyeGrade grade);

/// Square of the 95 % ellipse's radius, in standard deviations of a three-dimensional place whose scale is estimated
/// with some degrees of freedom: chi squared, to the first order of the F distribution.
[[nodiscard]] double ellipse_squared(double freedom);

/// Turns of a session's poses about each axis: root mean squares (rad) of the turns between all pairs of poses,
/// along the three principal axes, largest first.
[[nodiscard]] Eigen::Vector3d turns_by_axis(std::span<const HandEyeView> views);

}  // namespace slsd
