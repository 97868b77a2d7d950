// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/decoding.hpp"
#include "core/decode/regions/descriptors.hpp"

namespace slsd {

/// A region as the paper's search of the neighbourhood sees it.
struct PaperRegion {
  Descriptors shape;  ///< the centroid in pixels of the frame
  int letter = -1;    ///< or -1: it starts no search, but may be found
};

/// Links by Direction: index of the neighbour's region, or -1.
using Links = std::array<std::int32_t, 4>;

/// Properties of a pattern's grid around each symbol.
struct PaperGrid {
  struct Letter {
    bool carries_direction;
    double orientation_rad;  ///< the symbol's orientation as it is drawn
    bool fills_cell;         ///< its least rectangle is the cell, so that its area tells the grid distance
  };
  std::vector<Letter> letters;
  double spacing_to_size;
};

/// @param symbols  numbers 1 to 25; the letter is the index
[[nodiscard]] PaperGrid make_paper_grid(std::span<const int> symbols, int size_px, int spacing_px);

/// Links each letter with the right and the lower neighbour the paper's way. Both are expected at the grid distance, in
/// the letter's direction; where no region lies there, one diagonal is searched up to half the distance.
///
/// The direction is the orientation (equation (9)) less that of the drawn symbol; the grid distance is equation (11) as
/// printed, the share of the least rectangle as FAR and the spacing scaled as the symbol is. A letter that lacks one of
/// them takes it from the closest that has it within 2.5 grid distances (equations (10), (12)). Expected places are
/// equations (13) to (16), the diagonal (19) to (22). Where two letters find the same neighbour, the closer keeps it
/// (equations (17), (18)).
/// @param labels  of the frame's size: index of the region that covers a pixel, or -1
/// @return        one to a region; left and up are right and down seen from the other end
/// @thread reentrant
[[nodiscard]] std::vector<Links> link_grid_paper(std::span<const PaperRegion> regions,
                                                 const Image<std::int32_t>& labels, const PaperGrid& grid);

}  // namespace slsd
