// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/grids/grid_order.hpp"

#include <algorithm>

namespace slsd {
namespace {

GridOrder numbered(std::span<const Eigen::Vector2d> pixels, const Board& board, int way) {
  const int columns = board.columns;
  const int rows = board.rows;
  GridOrder order;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      int from_column = (way & 1) != 0 ? columns - 1 - column : column;
      int from_row = (way & 2) != 0 ? rows - 1 - row : row;
      if ((way & 4) != 0) std::swap(from_column, from_row);
      order.push_back(pixels[from_row * columns + from_column]);
    }
  }
  return order;
}

Eigen::Vector2d along_rows(const GridOrder& order, const Board& board) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int row = 0; row < board.rows; ++row) sum += order[(row + 1) * board.columns - 1] - order[row * board.columns];
  return sum.normalized();
}

Eigen::Vector2d along_columns(const GridOrder& order, const Board& board) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int column = 0; column < board.columns; ++column) {
    sum += order[(board.rows - 1) * board.columns + column] - order[column];
  }
  return sum.normalized();
}

bool is_mirrored(const GridOrder& order, const Board& board) {
  const Eigen::Vector2d right = along_rows(order, board);
  const Eigen::Vector2d down = along_columns(order, board);
  return right.x() * down.y() - right.y() * down.x() < 0;
}

}  // namespace

std::vector<GridOrder> grid_orders(std::span<const Eigen::Vector2d> pixels, const Board& board) {
  std::vector<GridOrder> orders;
  for (int way = 0; way < (board.columns == board.rows ? 8 : 4); ++way) {
    auto order = numbered(pixels, board, way);
    if (!is_mirrored(order, board)) orders.push_back(std::move(order));
  }
  std::ranges::stable_sort(orders, std::greater(), [&](const auto& order) { return along_rows(order, board).x(); });
  return orders;
}

std::vector<Tie> ties_around(const GridOrder& order, const Board& board, int id, int steps) {
  const int column = id % board.columns;
  const int row = id / board.columns;
  std::vector<Tie> ties;
  for (int y = std::max(0, row - steps); y <= std::min(board.rows - 1, row + steps); ++y) {
    for (int x = std::max(0, column - steps); x <= std::min(board.columns - 1, column + steps); ++x) {
      const int other = y * board.columns + x;
      ties.push_back({board.point(other).head<2>(), order[other]});
    }
  }
  return ties;
}

std::vector<Tie> ties_of(const GridOrder& order, const Board& board) {
  return ties_around(order, board, 0, std::max(board.columns, board.rows));
}

}  // namespace slsd
