// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/board/marker_family.hpp"
#include "core/result.hpp"

namespace slsd {

enum class BoardKind {
  kCharuco,     ///< a chessboard with a marker in each of its white squares
  kChessboard,  ///< black and white squares
  kCircles,     ///< black discs, every second row shifted by half the spacing
  kPlane,       ///< the reference plane: separate markers on white
};

/// A flat printed board. Its frame, seen from the front:
///
///     (0, 0) +---> x    the outer corner of the top left square (charuco, chessboard: a black one), or of the first
///            |          marker's cell (plane), or spacing_mm left of and above the first disc's centre (circles)
///            v y        z points away from the viewer
///
/// @thread reentrant
struct Board {
  BoardKind kind = BoardKind::kCharuco;
  int columns = 0;  ///< charuco: squares; chessboard: inner corners; circles: discs in a row; plane: markers
  int rows = 0;
  double pitch_mm = 0;  ///< square; circles: half the distance of two discs in a row; plane: distance between markers
  double mark_mm = 0;   ///< side of a marker, diameter of a disc; chessboard: 0
  const MarkerFamily* family = nullptr;  ///< charuco, plane

  /// The same board with lengths `factor` times the nominal ones.
  [[nodiscard]] Board scaled(double factor) const;
  /// Number of points on the board; ids start at 0.
  [[nodiscard]] int point_count() const;
  /// Number of markers, whose ids start at 0; 0 for a chessboard and circles.
  [[nodiscard]] int marker_count() const;
  /// Position of a point. Ids count from left to right in a row, row after row: inner corners, or centres of discs. For
  /// a plane, they count the four corners of each marker, clockwise from its top left.
  /// @return mm, in the board's frame, z = 0
  [[nodiscard]] Eigen::Vector3d point(int id) const;
  /// point(0), point(1) ...
  [[nodiscard]] std::vector<Eigen::Vector3d> points() const;
  /// Extent of the print: x from 0 to this, and y likewise. It needs a white border of at least one square.
  [[nodiscard]] double width_mm() const;
  [[nodiscard]] double height_mm() const;
  /// The print with its white border.
  [[nodiscard]] Eigen::AlignedBox2d sheet_mm() const;

  friend bool operator==(const Board&, const Board&) = default;
};

/// Reads
///
///     charuco:COLSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY     squares, as OpenCV counts them:
///     charuco:11x7:60:45:DICT_5X5_1000 chessboard:COLSxROWS:SQUARE_MM                       inner corners
///     circles:COLSxROWS:SPACING_MM:DIAMETER_MM             discs in a row, rows; half the distance of discs in a row
///     plane:COLSxROWS:PITCH_MM:MARKER_MM:DICTIONARY        markers
///
/// @errors kMalformed (not of that form), kInvalidArgument (numbers that no board can have)
/// @thread reentrant
[[nodiscard]] Result<Board> parse_board(std::string_view text);

/// The same print in the naming of rows by columns. Empty for kinds that look the same under either name.
/// @thread reentrant
[[nodiscard]] std::optional<Board> rows_by_columns(const Board& board);

/// Writes the text that parse_board() reads.
/// @thread reentrant
[[nodiscard]] std::string to_string(const Board& board);

/// Describes a board for messages: that text, with an explanation.
/// @thread reentrant
[[nodiscard]] std::string describe(const Board& board);

}  // namespace slsd
