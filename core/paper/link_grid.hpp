// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/regions/descriptors.hpp"
#include "core/regions/direction.hpp"

namespace slsd {

/// A region as the paper's neighbourhood search sees it.
struct PaperRegion {
  Descriptors shape;  ///< the centroid in pixels of the frame
  int letter = -1;    ///< or -1: it starts no search, but a search may find it
};

/// Links by Direction: index of the neighbour's region, or -1.
using Links = std::array<std::int32_t, 4>;

/// Properties of a pattern's grid around each symbol.
struct PaperGrid {
  struct Letter {
    bool carries_direction;
    double orientation_rad;  ///< the symbol's orientation as it is drawn
    bool fills_cell;         ///< its least rectangle is the cell, so its area gives the grid distance
  };
  std::vector<Letter> letters;
  double spacing_to_size;
};

/// @param symbols  numbers 1 to 25; the letter is the index
[[nodiscard]] PaperGrid make_paper_grid(std::span<const int> symbols, int size_px, int spacing_px);

/// Links each letter with its right and lower neighbour by the paper's method. Both are expected at the grid distance
/// in the letter's direction. If no region lies there, the search follows one diagonal up to half the distance.
///
/// The direction is the orientation (equation (9)) minus that of the drawn symbol. The grid distance is equation (11)
/// as printed, with the share of the least rectangle as FAR and the spacing scaled like the symbol. A letter that lacks
/// one of these takes it from the closest letter within 2.5 grid distances that has it (equations (10), (12)). Expected
/// places follow equations (13) to (16), the diagonal (19) to (22). If two letters find the same neighbour, the closer
/// one keeps it (equations (17), (18)).
/// @param labels  of the frame's size: index of the region that covers a pixel, or -1
/// @return        one for each region; left and up are the reverse of right and down
/// @thread reentrant
[[nodiscard]] std::vector<Links> link_grid_paper(std::span<const PaperRegion> regions,
                                                 const Image<std::int32_t>& labels, const PaperGrid& grid);

}  // namespace slsd
