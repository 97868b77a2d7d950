// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/find_board.hpp"

#include "core/board/board_photo.hpp"
#include "core/board/find_charuco.hpp"
#include "core/board/find_chessboard.hpp"
#include "core/board/find_circles.hpp"
#include "core/board/find_plane.hpp"

namespace slsd {
namespace {

constexpr int kLeastSidePx = 16;

}  // namespace

Result<BoardSighting> find_board(const GreyView& image, const Board& board) {
  const bool too_small = std::visit([](const auto& v) { return std::min(v.width, v.height) < kLeastSidePx; }, image);
  if (too_small) return fail(ErrorCode::kInvalidArgument, "an image of less than 16 x 16 px shows no board");
  const BoardPhoto photo = photograph(image);
  switch (board.kind) {
    case BoardKind::kCharuco:
      return find_charuco(photo, board);
    case BoardKind::kChessboard:
      return find_chessboard(photo, board);
    case BoardKind::kCircles:
      return find_circles(photo, board);
    default:
      return find_plane(photo, board);
  }
}

}  // namespace slsd
