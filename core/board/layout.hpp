// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/markers/find_markers.hpp"
#include "core/board/tie.hpp"
#include "core/result.hpp"

namespace slsd {

/// The square of a ChArUco board that contains a marker; for a plane, the marker's cell.
struct Square {
  int column = 0;
  int row = 0;
};

/// @param legacy  the layout of OpenCV before 4.6 for boards with an even number of rows: the top left square is white
/// @thread reentrant
[[nodiscard]] Square square_of_marker(const Board& board, int id, bool legacy = false);

/// The marker in a square, or empty if the square is black.
/// @thread reentrant
[[nodiscard]] std::optional<int> marker_in_square(const Board& board, Square square);

/// Corners of a marker on the board, clockwise from its top left, mm.
/// @thread reentrant
[[nodiscard]] std::array<Eigen::Vector2d, 4> marker_corners(const Board& board, Square square);

/// Keeps the markers that lie at their places on the board.
/// @param seen   markers of the board's family
/// @return       empty if no marker belongs to the board
/// @errors kMismatch (another board, or the legacy layout)
/// @thread reentrant
[[nodiscard]] Result<std::vector<SeenMarker>> markers_of_board(const std::vector<SeenMarker>& seen, const Board& board);

/// Four ties for each marker.
/// @thread reentrant
[[nodiscard]] std::vector<Tie> ties_of(const Board& board, std::span<const SeenMarker> markers, bool legacy = false);

}  // namespace slsd
