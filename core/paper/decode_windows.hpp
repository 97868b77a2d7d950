// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/paper/link_grid.hpp"

namespace slsd {

/// A cell of the pattern.
struct ArrayCell {
  int row, column;
  friend bool operator==(const ArrayCell&, const ArrayCell&) = default;
};

/// Finds each region's cell by the paper's method. Each region starts a 3x3 window to the right and down along the
/// links. If the window's codeword is exactly one of the array's, its nine regions get their cells. The paper has no
/// rule for repeated codewords or for windows that disagree. Here the array's first occurrence, and the first window in
/// the order of the regions, count. Elahi et al. 2020, section III G.
/// @param letters  letter of each region, or -1
/// @param links    from link_grid_paper, of the same length
/// @return         one for each region, in order; empty if no window names its cell
/// @thread reentrant
[[nodiscard]] std::vector<std::optional<ArrayCell>> decode_windows_paper(std::span<const int> letters,
                                                                         std::span<const Links> links,
                                                                         const CodeArray& array);

}  // namespace slsd
