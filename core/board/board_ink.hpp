// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/board/board.hpp"

namespace slsd {

/// A black rectangle on a board, mm in the board's frame.
struct InkRectangle {
  double x_mm = 0;
  double y_mm = 0;
  double width_mm = 0;
  double height_mm = 0;
};

/// A black disc on a board, mm in the board's frame.
struct InkDisc {
  double x_mm = 0;  ///< centre of the disc
  double y_mm = 0;
  double diameter_mm = 0;
};

/// Black shapes on a board. They do not overlap, but those of a marker share sides.
struct BoardInk {
  std::vector<InkRectangle> rectangles;
  std::vector<InkDisc> discs;
};

/// Computes the shapes of a board. ChArUco boards have OpenCV's layout since 4.6: the top left square is black.
/// @thread reentrant
[[nodiscard]] BoardInk ink_of(const Board& board);

}  // namespace slsd
