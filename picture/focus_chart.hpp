// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// A chart by which a projector is focused and framed, in whole black and white pixels: the outermost pixels lit all
/// around and a frame a twentieth of the height inside; a cross through the exact centre, two pixels wide where a side
/// is even; the size in pixels; and in the centre and the corners a star whose spokes run together where the light is
/// blurred, beside lines of one and of two pixels, upright and lying. Where the lines of one pixel are grey the picture
/// is scaled or blurred.
///
///     +-----------+-----------+
///     | * =       |       = * |
///     |           |           |      * star   = lines
///     +---------- * = --------+
///     |       1280x800        |
///     | * =       |       = * |
///     +-----------+-----------+
///
/// @param width_px, height_px  of the projector; what finds no room in a tiny one is cut
/// @thread reentrant
[[nodiscard]] Grey8 draw_focus_chart(int width_px, int height_px);

}  // namespace slsd
