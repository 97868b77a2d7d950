// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/markers/find_charuco.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/board/grids/corner_lattice.hpp"
#include "core/board/layout.hpp"
#include "core/board/markers/markers_in_photo.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLeastCorners = 6;

// Markers in the four squares that meet at a corner.
std::vector<SeenMarker> markers_around(const std::vector<SeenMarker>& markers, const Board& board, int id) {
  const int column = id % (board.columns - 1);
  const int row = id / (board.columns - 1);
  std::vector<SeenMarker> around;
  for (const SeenMarker& marker : markers) {
    const Square square = square_of_marker(board, marker.id);
    const bool meets =
        square.column >= column && square.column <= column + 1 && square.row >= row && square.row <= row + 1;
    if (meets) around.push_back(marker);
  }
  return around;
}

CornerLattice corners_by_markers(const BoardPhoto& photo, const Board& board, const std::vector<SeenMarker>& markers) {
  CornerLattice lattice(photo.light, board);
  for (int id = 0; id < board.point_count(); ++id) {
    const auto ties = ties_of(board, markers_around(markers, board, id));
    if (const auto local = fit_homography(ties)) lattice.look_for(id, *local);
  }
  return lattice;
}

}  // namespace

Result<BoardSighting> find_charuco(const BoardPhoto& photo, const Board& board) {
  const auto markers = markers_in_photo(photo, board);
  if (!markers) return tl::unexpected(markers.error());
  CornerLattice lattice = corners_by_markers(photo, board, *markers);
  lattice.drop_outliers();
  lattice.grow();
  auto corners = lattice.corners();
  if (!span_a_plane(corners, board, kLeastCorners)) {
    return fail(ErrorCode::kNotFound, "too little of the board is visible: " + std::to_string(corners.size()) +
                                          " corners of " + std::to_string(board.point_count()) + ", " +
                                          std::to_string(markers->size()) +
                                          " markers; show more of it, focus, or add light");
  }
  return summarise(std::move(corners), photo, board);
}

}  // namespace slsd
