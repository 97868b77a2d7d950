// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace slsd {

enum class Grade { kGood, kUsable, kBad };
[[nodiscard]] std::string_view to_string(Grade grade);
/// Finds the grade of a name; empty if no grade has it.
[[nodiscard]] std::optional<Grade> parse_grade(std::string_view name);

/// Limits of a figure for a good and for a usable calibration.
struct Bounds {
  double good, usable;
};
inline constexpr Bounds kHeldOutPx{0.3, 1.0};       ///< each pose under the calibration by the others
inline constexpr Bounds kEpipolarPx{0.3, 1.0};      ///< symbols off their epipolar lines, in the projector
inline constexpr Bounds kDepthShare{0.001, 0.005};  ///< the depth's deviation relative to the distance, at the middle
                                                    ///< of the range
inline constexpr double kCoverageGood = 0.5;        ///< share of an image
inline constexpr double kTiltGoodDeg = 15;          ///< tilt of the most tilted pose
inline constexpr std::size_t kPosesGood = 8;

/// A grade for a calibration, its reasons, and which poses to add.
struct Verdict {
  Grade grade = Grade::kBad;
  std::vector<std::string> reasons;  ///< faults that prevent a better grade; empty for a good one
  std::vector<std::string> advice;   ///< steps that would help most
};

}  // namespace slsd
