// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/decode/decoding.hpp"
#include "core/decode/grid/lattice_frame.hpp"
#include "core/executor.hpp"

namespace slsd {

/// A node of the grid, as link_grid sees it.
struct GridNode {
  Eigen::Vector2f centre_px;  ///< centre of the symbol's square, in the camera
  LatticeFrame frame;         ///< in: as expected; out: as measured from the neighbours, if there are any
  std::array<std::int32_t, 4> links{-1, -1, -1, -1};  ///< by Direction
  std::array<bool, 4> broken{};
  bool split = false;                           ///< in: its links are no evidence about the links beside them
  bool measured_u = false, measured_v = false;  ///< steps of the frame that come from neighbours
};

struct LinkGridOptions {
  float pitch_px = 18;           ///< distance between adjacent cells, projector px
  float search_radius = 0.42F;   ///< largest distance of a neighbour from its expected place in the first search, of
                                 ///< the pitch
  float refined_radius = 0.28F;  ///< the same once the frame is measured
  float deviation_max = 0.17F;   ///< largest difference of a link from those beside and behind it, as a share of the
                                 ///< pitch
};

/// The opposite direction.
[[nodiscard]] constexpr Direction opposite(Direction d) {
  return static_cast<Direction>((d + 2) % 4);
}

/// One of the two perpendicular directions, by 0 or 1.
[[nodiscard]] constexpr Direction across(Direction d, int side) {
  return static_cast<Direction>((d + (side == 0 ? 1 : 3)) % 4);
}

/// One step of the pattern in a direction, in cells.
[[nodiscard]] inline Eigen::Vector2f step(Direction d) {
  return {static_cast<float>((d == kRight) - (d == kLeft)), static_cast<float>((d == kDown) - (d == kUp))};
}

/// Calls visit(other) for a node and for every other whose frame is measured with it: up to two links along a line.
template <class Visit>
void visit_measured_with(const std::vector<GridNode>& nodes, std::int32_t node, Visit&& visit) {
  visit(node);
  for (const Direction d : kDirections) {
    std::int32_t other = node;
    for (int links = 0; links < 2; ++links) {
      other = nodes[other].links[d];
      if (other < 0) break;
      visit(other);
    }
  }
}

/// Links each symbol with its four neighbours on the grid. A neighbour is the symbol nearest to the place that the
/// local frame predicts, and the choice has to be mutual. The linker then measures frames from the links and repeats
/// the search with a smaller radius. Last, it breaks links whose step disagrees with those beside and behind them: they
/// cross an edge in depth.
///
///        up
///         |          frame.col(0) = camera px for one projector px to the right
///  left --o-- right  frame.col(1) = the same for one down
///         |
///       down
/// @thread thread-bound: keeps its buffers
class GridLinker {
 public:
  explicit GridLinker(LinkGridOptions options) : options_(options) {}

  void link(std::vector<GridNode>& nodes, Executor& executor);

  /// Measures a node's frame again, from trusted neighbours alone: the fragment of a symbol at the edge of a surface
  /// distorts the frames beside it.
  /// @param trusted  one for each node, non-zero if trusted
  void measure_frame(std::vector<GridNode>& nodes, const std::vector<std::uint8_t>& trusted, std::size_t node) const;

 private:
  void sort_into_buckets(const std::vector<GridNode>& nodes);
  [[nodiscard]] std::int32_t nearest(const std::vector<GridNode>& nodes, std::size_t from, Direction direction,
                                     const Eigen::Matrix2f& cells_from_camera, float radius) const;
  /// Nodes that are searched one after the other: each result helps with the next.
  struct Range {
    std::int32_t first, last;
    [[nodiscard]] bool contains(std::int32_t node) const { return node >= first && node < last; }
  };
  using Links = std::array<std::int32_t, 4>;  // by Direction
  [[nodiscard]] Links likely(const Range& range, std::int32_t from) const;
  [[nodiscard]] static unsigned find_evident(const std::vector<GridNode>& nodes, std::int32_t from, const Links& others,
                                             const Eigen::Matrix2f& cells_from_camera);
  void choose(const std::vector<GridNode>& nodes, const Range& range, std::int32_t from, float radius);
  void find_mutual(std::vector<GridNode>& nodes, float radius, Executor& executor);
  void measure_changed_frames(std::vector<GridNode>& nodes);
  void measure_steps(const std::vector<GridNode>& nodes, Executor& executor);
  [[nodiscard]] unsigned find_inconsistent(const GridNode& node, std::size_t index) const;
  void break_inconsistent(std::vector<GridNode>& nodes, Executor& executor);

  LinkGridOptions options_;
  float per_bucket_px_ = 1;
  Eigen::Vector2f origin_px_{0, 0};
  int columns_ = 0, rows_ = 0;
  struct Place {
    Eigen::Vector2f centre_px;
    std::int32_t node;
  };
  std::vector<std::int32_t> first_of_bucket_;
  std::vector<Place> in_buckets_;
  std::vector<Links> chosen_, hints_;
  std::vector<std::uint8_t> changed_;  // for each node: whether its links differ from its previous ones
  // Steps right and down from each node, as x, y, x, y, camera px, with one spare entry at the end. NaN without a link;
  // in sound_steps_, also NaN for links to or from split symbols.
  std::vector<std::array<float, 4>> steps_, sound_steps_;
  std::vector<std::array<bool, 4>> inconsistent_;
  std::vector<std::uint8_t> relinked_;  // for each node: whether the last search changed its links
  std::vector<std::uint8_t> all_trusted_;
};

}  // namespace slsd
