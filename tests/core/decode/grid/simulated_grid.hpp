// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/decode/grid/link_grid.hpp"
#include "core/decode/symbols/classify.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {

/// How a camera sees the plane of the pattern: homogeneous, camera px from projector px.
using GridMap = Eigen::Matrix3f;

/// Cells of a pattern as nodes of the grid, with known truth.
struct SimulatedGrid {
  static constexpr float kPitchPx = 18;
  std::vector<GridNode> nodes;
  std::vector<std::pair<int, int>> cells;  ///< row and column of each node
  std::map<std::pair<int, int>, std::int32_t> node_of_cell;

  void add(int row, int column, const Eigen::Vector2f& centre_px, const LatticeFrame& expected) {
    node_of_cell[{row, column}] = static_cast<std::int32_t>(nodes.size());
    cells.emplace_back(row, column);
    nodes.push_back({centre_px, expected});
  }
  [[nodiscard]] std::int32_t node_at(int row, int column) const {
    const auto found = node_of_cell.find({row, column});
    return found == node_of_cell.end() ? -1 : found->second;
  }
  /// The node one step away, -1 where that cell has none.
  [[nodiscard]] std::int32_t true_neighbour(std::size_t node, Direction direction) const {
    const Eigen::Vector2f to = step(direction);
    return node_at(cells[node].first + static_cast<int>(to.y()), cells[node].second + static_cast<int>(to.x()));
  }
  /// Links every node with the neighbours that it has.
  void link_truly() {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (const Direction d : {kRight, kDown, kLeft, kUp}) nodes[i].links[d] = true_neighbour(i, d);
    }
  }
};

/// What the classifier makes of a symbol that is this letter as surely as told, else any other.
inline Classification read_as(int letter, int letters, double sure) {
  Classification shape;
  for (int i = 0; i < letters; ++i)
    shape.log_probability[i] = static_cast<float>(std::log(i == letter ? sure : (1 - sure) / (letters - 1)));
  shape.letter = static_cast<std::int8_t>(letter);
  return shape;
}

/// Letters whose centroids are in the middles of their squares: as many as the shipped pattern of 16 px has.
inline std::vector<Prototype> flat_prototypes() {
  Prototype prototype{};
  prototype.mean.setZero(), prototype.whitening.setZero();
  prototype.centroid_px.setZero(), prototype.steady_centroid_px.setZero();
  return std::vector<Prototype>(5, prototype);
}

/// Of the shipped pattern of 16 px: the cells that it shows whole.
constexpr int kWholeRows = 44, kWholeColumns = 71;
/// The budget that the service ships with.
constexpr double kWrongCellsMax = 0.001;

inline Eigen::Vector2f through(const GridMap& camera_from_pattern, int row, int column) {
  const Eigen::Vector3f cell(SimulatedGrid::kPitchPx * static_cast<float>(column),
                             SimulatedGrid::kPitchPx * static_cast<float>(row), 1);
  return (camera_from_pattern * cell).hnormalized();
}

}  // namespace slsd
