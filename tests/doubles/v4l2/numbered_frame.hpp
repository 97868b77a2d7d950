// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/camera/frame.hpp"

namespace slsd::test {

/// Draws a frame's number, its 16 low bits, into every row, as black and white cells of 8 px behind a black and a white
/// one: legible after a mosaic's smoothing and JPEG.
/// @param image  at least 144 px wide
void numbered_frame(std::uint64_t number, Grey8& image);

/// The number that every row of the frame shows, or nothing where rows differ: a torn frame.
[[nodiscard]] std::optional<std::uint64_t> number_of(const GreyView& image);

}  // namespace slsd::test
