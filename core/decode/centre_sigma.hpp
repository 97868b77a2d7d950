// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/decode/grey_moments.hpp"

namespace slsd {

/// One standard deviation of a symbol's centre in x and in y, camera px.
///
/// The soft threshold lets noise in along the edge alone, a band about a pixel and a half wide: with w the area, n the
/// noise and c the contrast, var = (n / r c)^2 / sqrt(w), r the ramp, for a compact symbol. Below that stays what noise
/// does not explain: what is left of curvature and shading, 0.015 px on rendered planes and cylinders.
/// @thread reentrant
[[nodiscard]] double centre_sigma_px(const GreyMoments& moments);

}  // namespace slsd
