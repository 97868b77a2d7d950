// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>

#include "core/image.hpp"

namespace slsd {

/// Levels of red, green and blue, on the scale of the grey levels of the same frame.
using ColourLevels = std::array<std::uint16_t, 3>;
using ColourFrame = Image<ColourLevels>;

/// Factors of red, green and blue that make a white surface under the projector's white grey: the white balance.
using ColourGains = std::array<double, 3>;

}  // namespace slsd
