// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/board.hpp"

#include <utility>

namespace slsd {
namespace {

constexpr int kMarkerCorners = 4;

Eigen::Vector3d corner_of_marker(const Board& board, int id) {
  const int marker = id / kMarkerCorners;
  const int corner = id % kMarkerCorners;
  const double gap = (board.pitch_mm - board.mark_mm) / 2;
  const bool right = corner == 1 || corner == 2;
  const bool low = corner >= 2;
  return {marker % board.columns * board.pitch_mm + gap + (right ? board.mark_mm : 0),
          marker / board.columns * board.pitch_mm + gap + (low ? board.mark_mm : 0), 0};
}

Eigen::Vector3d lattice_point(int i, int j, double step) {
  return {(i + 1) * step, (j + 1) * step, 0};
}

}  // namespace

std::optional<Board> rows_by_columns(const Board& board) {
  const bool has_ends = board.kind == BoardKind::kCharuco || board.kind == BoardKind::kPlane;
  if (!has_ends || board.columns == board.rows) return std::nullopt;
  Board other = board;
  std::swap(other.columns, other.rows);
  return other;
}

Board Board::scaled(double factor) const {
  Board board = *this;
  board.pitch_mm *= factor;
  board.mark_mm *= factor;
  return board;
}

int Board::point_count() const {
  switch (kind) {
    case BoardKind::kCharuco:
      return (columns - 1) * (rows - 1);
    case BoardKind::kPlane:
      return kMarkerCorners * columns * rows;
    default:
      return columns * rows;
  }
}

int Board::marker_count() const {
  switch (kind) {
    case BoardKind::kCharuco:
      return columns * rows / 2;
    case BoardKind::kPlane:
      return columns * rows;
    default:
      return 0;
  }
}

Eigen::Vector3d Board::point(int id) const {
  switch (kind) {
    case BoardKind::kCharuco:
      return lattice_point(id % (columns - 1), id / (columns - 1), pitch_mm);
    case BoardKind::kChessboard:
      return lattice_point(id % columns, id / columns, pitch_mm);
    case BoardKind::kCircles:
      return lattice_point(2 * (id % columns) + id / columns % 2, id / columns, pitch_mm);
    default:
      return corner_of_marker(*this, id);
  }
}

std::vector<Eigen::Vector3d> Board::points() const {
  std::vector<Eigen::Vector3d> all;
  for (int id = 0; id < point_count(); ++id) all.push_back(point(id));
  return all;
}

double Board::width_mm() const {
  const int steps = kind == BoardKind::kCircles      ? 2 * columns + 1
                    : kind == BoardKind::kChessboard ? columns + 1
                                                     : columns;
  return steps * pitch_mm;
}

double Board::height_mm() const {
  const bool between = kind == BoardKind::kCircles || kind == BoardKind::kChessboard;
  return (between ? rows + 1 : rows) * pitch_mm;
}

Eigen::AlignedBox2d Board::sheet_mm() const {
  const Eigen::Vector2d border(pitch_mm, pitch_mm);
  return {-border, Eigen::Vector2d(width_mm(), height_mm()) + border};
}

}  // namespace slsd
