// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// A chart for focusing and framing a projector, in whole black and white pixels. The outermost pixels are lit all
/// around, and a frame runs a twentieth of the height inside. A cross marks the exact centre, two pixels wide if a side
/// is even. The chart shows its size in pixels. The centre and the corners have stars, whose spokes merge if the light
/// is blurred. Beside them are lines of one and two pixels, vertical and horizontal. If the one-pixel lines look grey,
/// the picture is scaled or blurred.
///
///     +-----------+-----------+
///     | * =       |       = * |
///     |           |           |      * star   = lines
///     +---------- * = --------+
///     |       1280x800        |
///     | * =       |       = * |
///     +-----------+-----------+
///
/// @param width_px, of the projector; elements that do not fit a tiny one are clipped
/// @thread reentrant
[[nodiscard]] Grey8 draw_focus_chart(int width_px, int height_px);

}  // namespace slsd
