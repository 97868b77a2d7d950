// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace slsd {

enum class Grade { kGood, kUsable, kBad };
[[nodiscard]] std::string_view to_string(Grade grade);
/// Nothing: it is the name of none.
[[nodiscard]] std::optional<Grade> parse_grade(std::string_view name);

/// One word on a calibration, why, and what to shoot next.
struct Verdict {
  Grade grade = Grade::kBad;
  std::vector<std::string> reasons;  ///< what keeps it from a better grade; empty for a good one
  std::vector<std::string> advice;   ///< what would help most
};

struct CalibrationOutcome;
/// By the errors on poses held out, by how sure the depth is, and by how much of both images the poses cover.
/// @thread reentrant
[[nodiscard]] Verdict judge(const CalibrationOutcome& outcome);

}  // namespace slsd
