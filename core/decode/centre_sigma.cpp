// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centre_sigma.hpp"

#include <cmath>

namespace slsd {

double centre_sigma_px(const GreyMoments& moments) {
  constexpr double kUnexplainedPx = 0.015, kRamp = kRampEnd - kRampStart;
  const double relative_noise = moments.noise / (kRamp * (moments.peak - moments.background));
  return std::sqrt(relative_noise * relative_noise / std::sqrt(moments.weight) + kUnexplainedPx * kUnexplainedPx);
}

}  // namespace slsd
