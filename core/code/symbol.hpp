// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

inline constexpr int kSymbolCount = 25;
inline constexpr int kSymbolSizesPx[] = {8, 10, 12, 14, 16};

/// One of the 25 primitives of the alphabet (Elahi et al. 2020, figure 1), at every size drawn by the same rule.
struct Symbol {
  int number;                    ///< 1 to 25, the paper's numbering
  std::string_view name;         ///< "horizontal bar"
  std::string_view description;  ///< the rule in words
  bool carries_direction;        ///< whether its second moments tell the direction of the grid (modulo 180 degrees)
};

/// The symbol with this number.
/// @param number  1 to 25; anything else is a bug of the caller's
[[nodiscard]] const Symbol& symbol(int number);

/// Draws a symbol in its cell: size_px x size_px, 1 where it is lit, 0 where it is dark.
/// @param number   1 to 25
/// @param size_px  one of kSymbolSizesPx
[[nodiscard]] Grey8 draw_symbol(int number, int size_px);

}  // namespace slsd
