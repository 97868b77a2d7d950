// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// A sheet of paper in either orientation.
struct Paper {
  std::string name;
  double width_mm = 0;
  double height_mm = 0;

  [[nodiscard]] Paper turned() const { return {name, height_mm, width_mm}; }
  friend bool operator==(const Paper&, const Paper&) = default;
};

/// Reads A0 to A4 or letter, in either case, or WIDTHxHEIGHT in mm. Named papers are in landscape orientation.
/// @errors kInvalidArgument (unknown paper, or sides outside 50 to 10000 mm)
/// @thread reentrant
[[nodiscard]] Result<Paper> parse_paper(std::string_view text);

}  // namespace slsd
