// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "picture/canvas.hpp"
#include "picture/cloud/surface.hpp"
#include "picture/cloud/view.hpp"

namespace slsd {

/// Draws the background of the cloud: floor, side and back of the box with their grids, and the cloud's soft shadow.
void draw_room(ColourImage& picture, const View& view, const Box& box, const Surface& surface);

/// Draws the numbers along the box's edges and the names of its axes.
/// @param text_px  height of a capital letter
void draw_axes(Canvas& canvas, const View& view, const Box& box, double text_px);

}  // namespace slsd
