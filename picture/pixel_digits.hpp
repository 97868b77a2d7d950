// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

#include "core/image.hpp"

namespace slsd {

/// Writes a number of pixels, such as "1280x800", in letters of 3 by 5 lit squares, one square apart. Clips at the
/// image's borders; letters other than digits and "x" are gaps.
/// @param left, top  of the first letter
/// @param square_px  side of a square, at least 1
/// @thread reentrant
void draw_pixel_digits(Grey8& image, int left, int top, int square_px, std::string_view digits);

/// @return the width of the text, px
[[nodiscard]] int pixel_digits_width(int square_px, std::string_view digits);

}  // namespace slsd
