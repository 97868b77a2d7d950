// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/decode/grid/cell_claim.hpp"
#include "core/decode/grid/link_grid.hpp"

namespace slsd {

/// The nodes of the 3x3 window around a node, row by row, itself in the middle; -1 where the links do not lead to one.
using Neighbourhood = std::array<std::int32_t, kWindowCells>;

/// The neighbour along a link that is not broken, or -1.
[[nodiscard]] inline std::int32_t neighbour(const std::vector<GridNode>& nodes, std::int32_t node,
                                            Direction direction) {
  if (node < 0 || nodes[node].broken[direction]) return -1;
  return nodes[node].links[direction];
}

/// That neighbour, if it is decoded, of the same island and of the cell that lies there; -1 otherwise.
[[nodiscard]] inline std::int32_t decoded_beside(const std::vector<GridNode>& nodes,
                                                 const std::vector<CellClaim>& claims, std::int32_t node,
                                                 Direction direction) {
  const std::int32_t other = neighbour(nodes, node, direction);
  if (other < 0 || claims[other].status != RegionStatus::kDecoded) return -1;
  return claims[other].island == claims[node].island && claims[node].fits(claims[other], direction) ? other : -1;
}

/// What links that are not broken lead to from a node, each once, the nearest first.
/// @thread thread-bound: keeps its buffers
class LinkWalk {
 public:
  struct Stop {
    std::int32_t node;
    int rows, columns;  ///< from the first, as the links lead
  };
  enum class Go : std::uint8_t { kOn, kPast, kNoFarther };

  /// @param reach  links
  /// @param look   (from, to, direction) -> Go, asked of links to what has not been reached: whether to go on there, to
  ///               leave it out, or to end the walk
  /// @return       what was reached, the node itself first; stands until the next walk
  template <class Look>
  const std::vector<Stop>& walk(const std::vector<GridNode>& nodes, std::int32_t node, int reach, const Look& look) {
    is_reached_.resize(nodes.size());
    stops_.assign(1, {node, 0, 0});
    is_reached_[node] = 1;
    std::size_t next = 0;
    bool on = true;
    for (int links = 0; links < reach && next < stops_.size() && on; ++links)
      for (const std::size_t end = stops_.size(); next < end && on; ++next) on = look_on(nodes, stops_[next], look);
    for (const Stop& stop : stops_) is_reached_[stop.node] = 0;
    return stops_;
  }

 private:
  template <class Look>
  bool look_on(const std::vector<GridNode>& nodes, Stop from, const Look& look) {
    for (const Direction d : kDirections) {
      const std::int32_t other = neighbour(nodes, from.node, d);
      if (other < 0 || is_reached_[other] != 0) continue;
      const Stop to{other, from.rows + (d == kDown) - (d == kUp), from.columns + (d == kRight) - (d == kLeft)};
      const Go go = look(from, to, d);
      if (go == Go::kNoFarther) return false;
      if (go == Go::kPast) continue;
      stops_.push_back(to);
      is_reached_[other] = 1;
    }
    return true;
  }

  std::vector<Stop> stops_;
  std::vector<std::uint8_t> is_reached_;  // of each node; none is between calls
};

/// A node's neighbours along links that are not broken, by Direction; -1 where there is none.
using Beside = std::array<std::int32_t, 4>;

/// @param beside  becomes one to a node: what many steps ask for, in a third of the memory
void find_beside(const std::vector<GridNode>& nodes, std::vector<Beside>& beside);

/// Follows the links around a node. A corner can be reached by two ways; where they lead to different nodes it is left
/// out.
[[nodiscard]] Neighbourhood neighbourhood(std::span<const Beside> beside, std::int32_t node);

}  // namespace slsd
