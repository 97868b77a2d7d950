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
inline constexpr std::size_t kFirstTerm = 4;  ///< of distortion, in LensVector

/// How large each term of a lens's distortion may be before anything of it was seen: one standard deviation about 0, of
/// k1 k2 p1 p2 k3.
using DistortionPrior = std::array<double, 5>;
inline constexpr DistortionPrior kUsualDistortion{0.3, 0.2, 1e-3, 1e-3, 0.1};  ///< of wide lenses

/// What lenses have: in wide ones the coefficients themselves are about so large; in long ones, which see small angles
/// only, what they move the outermost pixel by, as a share of its distance from the middle. All terms are adjusted. One
/// that the poses do not tell stays at 0 with this deviation, and what depends on it is as uncertain as it makes it:
/// held at 0 instead it would pull focal lengths and principal points away by many of their deviations.
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
