// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/margin.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {

float margin_for(double wrong_cells_max) {
  constexpr double kMargin = 8, kWrongCells = 0.005, kPerNat = 0.585;
  return static_cast<float>(
      std::clamp(kMargin + std::log(kWrongCells / wrong_cells_max) / kPerNat, 0., static_cast<double>(kMarginMax)));
}

double wrong_share(float margin_nats) {
  constexpr double kAtNone = 2.75, kPerNat = 0.8;  // of the logarithm: if chance alone decided, it would fall by 1 for
                                                   // each nat
  return std::exp(-kAtNone - kPerNat * static_cast<double>(margin_nats));
}

}  // namespace slsd
