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

/// Draws a cloud for people: seen from beside and above the scanner, neighbours of the lattice joined where depth runs
/// on, shaded, coloured by depth; axes in millimetres (rig frame), a scale bar and a colour bar.
/// @param measured  points that the title names; those of the cloud, unless it is a part of a larger one
/// @return          a picture with its axes alone where the cloud is empty
/// @thread          reentrant
[[nodiscard]] ColourImage render_cloud(const Cloud& cloud, CloudPictureSize size = {},
                                       std::optional<std::size_t> measured = {});

}  // namespace slsd
