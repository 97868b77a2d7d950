// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/find_board.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/board/board_photo.hpp"
#include "core/board/find_plane.hpp"
#include "core/board/grids/find_chessboard.hpp"
#include "core/board/grids/find_circles.hpp"
#include "core/board/markers/find_charuco.hpp"

namespace slsd {
namespace {

constexpr int kLeastSidePx = 16;
/// Smallest share of a picture's saturated pixels that indicates a reflection on a board.
constexpr double kClippedShare = 0.01;

double full_share(const BoardPhoto& photo) {
  std::size_t full = 0;
  for (int y = 0; y < photo.light.height(); ++y)
    full +=
        static_cast<std::size_t>(std::count_if(photo.light.row(y), photo.light.row(y) + photo.light.width(),
                                               [&](float level) { return static_cast<double>(level) >= photo.full; }));
  return static_cast<double>(full) / (static_cast<double>(photo.light.width()) * photo.light.height());
}

Result<BoardSighting> find(const BoardPhoto& photo, const Board& board) {
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

}  // namespace

Result<BoardSighting> find_board(const GreyView& image, const Board& board) {
  const bool too_small = std::visit([](const auto& v) { return std::min(v.width, v.height) < kLeastSidePx; }, image);
  if (too_small) return fail(ErrorCode::kInvalidArgument, "an image smaller than 16 x 16 px cannot show a board");
  const BoardPhoto photo = photograph(image);
  auto found = find(photo, board);
  if (const double share = found ? 0 : full_share(photo); share > kClippedShare) {
    return fail(found.error().code,
                "clipped: " + std::to_string(std::lround(100 * share)) +
                    " % of the picture's pixels are at full level, and the rest does not show the board (" +
                    found.error().message + "); expose less, or turn shiny parts away");
  }
  return found;
}

}  // namespace slsd
