// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

namespace slsd {

inline constexpr int kSymbolCount = 25;
inline constexpr int kSymbolSizesPx[] = {8, 10, 12, 14, 16};

/// One of the 25 primitives of the alphabet (Elahi et al. 2020, figure 1), drawn by the same rule at every size.
struct Symbol {
  int number;                    ///< 1 to 25, the paper's numbering
  std::string_view name;         ///< "horizontal bar"
  std::string_view description;  ///< the rule in words
  bool carries_direction;        ///< whether its second moments give the direction of the grid (modulo 180 degrees)
};

}  // namespace slsd
