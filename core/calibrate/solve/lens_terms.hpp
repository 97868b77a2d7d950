// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "core/calibrate/observe/observations.hpp"

namespace slsd {

inline constexpr std::string_view kLensParameterNames[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
inline constexpr std::size_t kFirstTerm = 4;  ///< first term of distortion in LensVector

/// Size that each term of a lens's distortion may have before any observation: one standard deviation about 0, for k1
/// k2 p1 p2 k3.
using DistortionPrior = std::array<double, 5>;
inline constexpr DistortionPrior kUsualDistortion{0.3, 0.2, 1e-3, 1e-3, 0.1};  ///< for wide lenses

/// Plausible distortion of a lens: one standard deviation of each term. Wide lenses have kUsualDistortion. Long lenses
/// see small angles only, so their coefficients may be larger. There the limit is the relative shift of the outermost
/// pixel, 5 % by k1. All terms are adjusted. A term that the poses do not determine stays at 0 with this deviation,
/// which adds to the uncertainty of dependent results. Fixing it at 0 instead would bias focal lengths and principal
/// points by many of their deviations.
[[nodiscard]] inline DistortionPrior plausible_distortion(const ImageSize& size, double focal_px) {
  const double half_px = 0.5 * std::hypot(size.width_px, size.height_px);
  const double radius = std::max(half_px / std::max(focal_px, 1.0), 1e-3);
  const double square = radius * radius;
  const DistortionPrior in_picture{0.05 / square, 1e-3 / (square * square), 5e-4 / (3 * radius), 5e-4 / (3 * radius),
                                   1e-4 / (square * square * square)};
  DistortionPrior prior = kUsualDistortion;
  for (std::size_t i = 0; i < prior.size(); ++i) prior[i] = std::max(prior[i], in_picture[i]);
  return prior;
}

}  // namespace slsd
