// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>

#include "core/cloud/cloud.hpp"
#include "core/image.hpp"

namespace slsd {

struct CloudPictureSize {
  int width_px = 1600;   ///< 320 to 8192
  int height_px = 1200;  ///< 240 to 8192
};

/// Draws a cloud for people, seen from beside and above the scanner. Joins neighbours of the lattice if depth is
/// continuous; shades them and colours them by depth. Adds axes in millimetres (rig frame), a scale bar and a colour
/// bar.
/// @param measured  number of points in the title; the cloud's own, unless it is part of a larger one
/// @return          a picture; with axes alone if the cloud is empty
/// @thread          reentrant
[[nodiscard]] ColourImage render_cloud(const Cloud& cloud, CloudPictureSize size = {},
                                       std::optional<std::size_t> measured = {});

}  // namespace slsd
