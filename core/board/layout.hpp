// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/find_markers.hpp"
#include "core/board/tie.hpp"
#include "core/result.hpp"

namespace slsd {

/// The square that a marker of a ChArUco board is in; for a plane the marker's cell.
struct Square {
  int column = 0;
  int row = 0;
};

/// @param legacy  as OpenCV before 4.6 laid out boards of an even number of rows: the top left square is white
/// @thread reentrant
[[nodiscard]] Square square_of_marker(const Board& board, int id, bool legacy = false);

/// The marker in a square, or nothing where the square is black.
/// @thread reentrant
[[nodiscard]] std::optional<int> marker_in_square(const Board& board, Square square);

/// Corners of a marker on the board, clockwise from its top left, mm.
/// @thread reentrant
[[nodiscard]] std::array<Eigen::Vector2d, 4> marker_corners(const Board& board, Square square);

/// Keeps the markers that lie where the board has them.
/// @param seen   of the board's family
/// @return       empty where none is of the board
/// @errors kMismatch (another board, or the legacy layout)
/// @thread reentrant
[[nodiscard]] Result<std::vector<SeenMarker>> markers_of_board(const std::vector<SeenMarker>& seen, const Board& board);

/// Four ties to a marker.
/// @thread reentrant
[[nodiscard]] std::vector<Tie> ties_of(const Board& board, std::span<const SeenMarker> markers, bool legacy = false);

}  // namespace slsd
