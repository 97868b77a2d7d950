// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/decode/paper/link_grid.hpp"

namespace slsd {

/// A cell of the pattern.
struct ArrayCell {
  int row, column;
  friend bool operator==(const ArrayCell&, const ArrayCell&) = default;
};

/// Finds each region's cell the paper's way: each region starts a 3x3 window to the right and down along the links; a
/// window whose codeword is one of the array's, exactly, gives its nine regions their cells. The paper has no rule for
/// a codeword that occurs several times, nor for windows that disagree: the first of the array, and the first window in
/// the order of the regions, stand.
/// Elahi et al. 2020, section III G.
/// @param letters  of each region, or -1
/// @param links    as of link_grid_paper, of the same length
/// @return         one to a region, in its order; nothing where no window names it
/// @thread reentrant
[[nodiscard]] std::vector<std::optional<ArrayCell>> decode_windows_paper(std::span<const int> letters,
                                                                         std::span<const Links> links,
                                                                         const CodeArray& array);

}  // namespace slsd
