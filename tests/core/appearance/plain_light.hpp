// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>

#include "core/image.hpp"

namespace slsd::test {

/// The light of a pattern whose pixels are squares, blurred by a Gaussian: the integral, pixel by pixel.
inline double plain_light(const Grey8& pattern, double sigma_px, double u, double v) {
  const int reach = static_cast<int>(std::ceil(5 * sigma_px)) + 1;
  const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
  const auto share = [&](int pixel, double at) {
    const double root = sigma_px * std::sqrt(2.0);
    return 0.5 * (std::erf((pixel + 0.5 - at) / root) - std::erf((pixel - 0.5 - at) / root));
  };
  double light = 0;
  for (int y = row - reach; y <= row + reach; ++y) {
    for (int x = column - reach; x <= column + reach; ++x) {
      if (x < 0 || y < 0 || x >= pattern.width() || y >= pattern.height()) continue;
      light += share(x, u) * share(y, v) * pattern.at(x, y) / 255;
    }
  }
  return light;
}

}  // namespace slsd::test
