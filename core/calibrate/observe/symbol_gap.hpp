// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <vector>

#include "core/calibrate/observe/board_region.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/centres/symbol_match.hpp"
#include "core/image.hpp"

namespace slsd {

/// A place on the board where the pattern should be seen, as the projector lights it there, and is not.
struct SymbolGap {
  std::size_t symbols = 0;  ///< number of unseen symbols; 0: there is no such place
  bool clipped = false;     ///< the white picture is at full level there
};

/// Finds such places, of 5 by 5 symbols or more. Single symbols that are not read, ink that hides a row of them, and
/// those that the board's edge cuts are none.
/// @param found  on the board, of one look at it
/// @param white  the picture under the white projector
/// @thread reentrant
[[nodiscard]] SymbolGap find_symbol_gap(const std::vector<SymbolMatch>& found, const Pattern& pattern,
                                        const BoardRegion& region, const GreyView& white);

}  // namespace slsd
