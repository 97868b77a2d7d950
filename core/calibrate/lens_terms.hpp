// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

namespace slsd {

/// Which terms of a lens's distortion are adjusted; the others are zero.
struct LensTerms {
  bool k1 = true, k2 = true, tangential = true, k3 = false;

  friend bool operator==(const LensTerms&, const LensTerms&) = default;
};

inline constexpr std::string_view kLensParameterNames[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};

/// Whether the parameter at an index of LensVector is adjusted.
[[nodiscard]] constexpr bool adjusts(const LensTerms& terms, int index) {
  switch (index) {
    case 4:
      return terms.k1;
    case 5:
      return terms.k2;
    case 6:
    case 7:
      return terms.tangential;
    case 8:
      return terms.k3;
    default:
      return true;
  }
}

}  // namespace slsd
