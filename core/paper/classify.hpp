// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/regions/descriptors.hpp"
#include "core/result.hpp"

namespace slsd {

/// The ten descriptors as they are compared with thresholds, independent of scale.
///
/// rectangularity, eccentricity, aspect ratio, convex to area, perimeter to area times equivalent diameter, area and
/// equivalent diameter as shares of the cell's, filled area ratio, Euler number; the tenth, orientation, stands apart
/// because it is an angle.
inline constexpr int kComparedCount = 9;
using ComparedDescriptors = std::array<double, kComparedCount>;

/// @param side_px  side of a symbol's cell without its spacing, as the camera sees it
[[nodiscard]] ComparedDescriptors compared(const Descriptors& shape, double side_px);

/// Intervals in which a region's descriptors lie if it is a letter; open at the ends.
struct LetterThresholds {
  struct Interval {
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
  };
  std::array<Interval, kComparedCount> intervals;
  double orientation_rad = 0;     ///< the symbol's orientation as it is drawn
  double orientation_margin_rad;  ///< half the interval around it, modulo pi; pi if the symbol has no direction
};

/// The thresholds of the paper's table 6 for any choice of symbols. They lie midway between the values of two drawn
/// symbols that a descriptor separates. Elahi et al. 2020, sections III D and IV.
/// @param symbols  numbers 1 to 25; the letter is the index
/// @param size_px  one of kSymbolSizesPx
/// @errors kUnsupported: two of the symbols have the same descriptors; the message names them
[[nodiscard]] Result<std::vector<LetterThresholds>> make_thresholds(std::span<const int> symbols, int size_px);

/// The only letter whose intervals all hold, or -1.
/// @param side_px  as in compared()
/// @thread reentrant
[[nodiscard]] int classify_paper(const Descriptors& shape, std::span<const LetterThresholds> letters, double side_px);

}  // namespace slsd
