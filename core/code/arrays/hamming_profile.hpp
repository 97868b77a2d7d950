// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>

#include "core/code/code_array.hpp"

namespace slsd {

enum class Windows {
  kAligned,      ///< side by side, as the paper compares them
  kOverlapping,  ///< at every cell, as the decoder reads them
};

/// Histogram of an array's pairs of windows by the number of differing cells.
struct HammingProfile {
  std::array<std::int64_t, kWindowCells + 1> pairs{};  ///< by distance, 0 to 9

  [[nodiscard]] std::int64_t comparisons() const;
  [[nodiscard]] double mean() const;
  /// Share of pairs that differ in at least so many cells, 0 to 1.
  [[nodiscard]] double share_from(int distance) const;
  [[nodiscard]] int minimum() const;
};

/// The Hamming distance profile of an array. Elahi et al. 2020, figure 3 and table 3, equations (3) and (4).
/// @param array  with at least two windows
/// @thread reentrant
[[nodiscard]] HammingProfile hamming_profile(const CodeArray& array, Windows windows);

}  // namespace slsd
