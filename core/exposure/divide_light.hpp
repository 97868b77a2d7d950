// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The level of a quotient where the pattern is as bright as white, and that of a saturated pixel.
inline constexpr double kAsBrightAsWhite = 50000, kQuotientFull = 65535;

/// The pattern's image divided by the white one: what is printed on a surface, and how the light falls on it, goes out;
/// what is left is the pattern. Where the white image is hardly above its noise there is nothing to see, and the
/// quotient goes to 0.
/// @param pattern  of the same size as white
/// @param dark     with the projector black: the light of the room, which is taken from both
/// @return 16 bits; 50000 where the pattern is as bright as white
/// @errors kMismatch: the images are not of the same size
/// @thread reentrant
[[nodiscard]] Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white,
                                          const std::optional<GreyView>& dark = std::nullopt);

}  // namespace slsd
