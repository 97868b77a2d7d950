// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <map>
#include <vector>

#include "core/board/board.hpp"
#include "core/board/measured_points.hpp"
#include "core/board/tie.hpp"
#include "core/image.hpp"

namespace slsd {

/// The inner corners of a chessboard or a ChArUco board, found one by one.
/// @thread thread-bound
class CornerLattice {
 public:
  /// Keeps references to both.
  /// @param white_first  whether the square at the board's top left is white
  CornerLattice(const Image<float>& light, const Board& board, bool white_first = false);

  /// Fits a corner at the place that a homography of its surroundings predicts; keeps it if its colours are right.
  bool look_for(int id, const Homography& local);
  /// Drops the corners that are not where their neighbours predict them.
  void drop_outliers();
  /// Searches beside the found corners until no more are found.
  void grow();

  [[nodiscard]] std::vector<MeasuredPoint> corners() const;

 private:
  [[nodiscard]] int columns() const;
  [[nodiscard]] int rows() const;
  [[nodiscard]] std::vector<Tie> neighbours(int id) const;
  [[nodiscard]] bool is_outlier(int id) const;

  const Image<float>* light_;
  const Board* board_;
  bool white_first_;
  std::map<int, MeasuredPoint> corners_;
};

}  // namespace slsd
