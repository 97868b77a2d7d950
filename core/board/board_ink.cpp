// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/board_ink.hpp"

#include "core/board/layout.hpp"

namespace slsd {
namespace {

void add_squares(BoardInk& ink, const Board& board, int columns, int rows) {
  for (int row = 0; row < rows; ++row) {
    for (int column = row % 2; column < columns; column += 2) {
      ink.rectangles.push_back({column * board.pitch_mm, row * board.pitch_mm, board.pitch_mm, board.pitch_mm});
    }
  }
}

// One rectangle for each run of black cells in a row.
void add_marker(BoardInk& ink, const Board& board, int id) {
  const Eigen::Vector2d first = marker_corners(board, square_of_marker(board, id))[0];
  const int cells = board.family->cells();
  const double cell_mm = board.mark_mm / cells;
  for (int row = 0; row < cells; ++row) {
    for (int begin = 0, end = 0; begin < cells; begin = end + 1) {
      for (end = begin; end < cells && is_black(*board.family, id, end, row);) ++end;
      if (end == begin) continue;
      ink.rectangles.push_back(
          {first.x() + begin * cell_mm, first.y() + row * cell_mm, (end - begin) * cell_mm, cell_mm});
    }
  }
}

}  // namespace

BoardInk ink_of(const Board& board) {
  BoardInk ink;
  if (board.kind == BoardKind::kChessboard) add_squares(ink, board, board.columns + 1, board.rows + 1);
  if (board.kind == BoardKind::kCharuco) add_squares(ink, board, board.columns, board.rows);
  for (int id = 0; id < board.marker_count(); ++id) add_marker(ink, board, id);
  if (board.kind == BoardKind::kCircles) {
    for (const auto& centre : board.points()) ink.discs.push_back({centre.x(), centre.y(), board.mark_mm});
  }
  return ink;
}

}  // namespace slsd
