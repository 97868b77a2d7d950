// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/board/find_board.hpp"
#include "core/image.hpp"

namespace slsd {

/// Shift of the board's print in the pattern's picture, relative to the white one. The print's edges are also visible
/// there, wherever the pattern lights them.
struct PrintShift {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double significance = 0;  ///< its distance from all other shifts, in standard deviations: about 10 for pictures of
                            ///< one pose, below 4 for those of two

  [[nodiscard]] bool certain() const { return significance > 6; }
};

/// Compares the gradients of both pictures' logarithms at the print's edges, over all shifts of up to 24 px.
/// @return a significance of 0 if the board has too few edges
/// @thread reentrant
[[nodiscard]] PrintShift find_print_shift(const GreyView& white, const GreyView& pattern, const Board& board,
                                          const BoardSighting& sighting);

}  // namespace slsd
