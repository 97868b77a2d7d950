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

/// A place on the board where the projector lights the pattern, but none of it is seen.
struct SymbolGap {
  std::size_t symbols = 0;  ///< number of unseen symbols; 0: no such place
  bool clipped = false;     ///< the white picture is saturated there
};

/// Finds such places, of at least 5 by 5 symbols. Single unread symbols, a row hidden by ink, and symbols cut by the
/// board's edge do not count.
/// @param found  symbols found on the board in one view
/// @param white  the picture under the white projector
/// @thread reentrant
[[nodiscard]] SymbolGap find_symbol_gap(const std::vector<SymbolMatch>& found, const Pattern& pattern,
                                        const BoardRegion& region, const GreyView& white);

}  // namespace slsd
