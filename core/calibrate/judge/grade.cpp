// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/grade.hpp"

namespace slsd {

std::string_view to_string(Grade grade) {
  switch (grade) {
    case Grade::kGood:
      return "good";
    case Grade::kUsable:
      return "usable";
    case Grade::kBad:
      break;
  }
  return "bad";
}

std::optional<Grade> parse_grade(std::string_view name) {
  for (const Grade grade : {Grade::kGood, Grade::kUsable, Grade::kBad}) {
    if (to_string(grade) == name) return grade;
  }
  return std::nullopt;
}

}  // namespace slsd
