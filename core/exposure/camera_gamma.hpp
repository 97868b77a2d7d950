// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/exposure/noise_between.hpp"

namespace slsd {

/// The camera's gamma: its grey levels are light to this power. 1: levels are proportional to light.
struct CameraGamma {
  double likeliest = 1;
  double low = 1, high = 1;  ///< two standard deviations below and above, within 0.3 to 1.2

  /// Tells whether the levels are surely not proportional to light.
  [[nodiscard]] bool bends() const { return high < 0.9; }
};

/// Estimates the camera's gamma from its noise. Photon noise has a variance in proportion to light, beside a constant
/// one of the sensor:
///
///     level = light ^ gamma    variance of a level = (gamma light ^ (gamma - 1)) ^ 2 (sensor + photons light)
///
/// @return empty if the noise does not tell: too few levels, noise of another kind, or an interval of over 0.4
/// @thread reentrant
[[nodiscard]] std::optional<CameraGamma> estimate_gamma(const NoiseBetween& noise, double full);

}  // namespace slsd
