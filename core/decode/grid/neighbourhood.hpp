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

/// The nodes of the 3x3 window around a node, row by row, with the node in the middle; -1 if the links do not lead to
/// one.
using Neighbourhood = std::array<std::int32_t, kWindowCells>;

/// The neighbour along a link that is not broken, or -1.
[[nodiscard]] inline std::int32_t neighbour(const std::vector<GridNode>& nodes, std::int32_t node,
                                            Direction direction) {
  if (node < 0 || nodes[node].broken[direction]) return -1;
  return nodes[node].links[direction];
}

/// Finds the neighbour in a direction if it is decoded as the cell that lies there; -1 otherwise.
[[nodiscard]] inline std::int32_t decoded_beside(const std::vector<GridNode>& nodes,
                                                 const std::vector<CellClaim>& claims, std::int32_t node,
                                                 Direction direction) {
  const std::int32_t other = neighbour(nodes, node, direction);
  if (other < 0 || claims[other].status != RegionStatus::kDecoded) return -1;
  return claims[node].fits(claims[other], direction) ? other : -1;
}

/// A node's neighbours along unbroken links, by Direction; -1: none.
using Beside = std::array<std::int32_t, 4>;

/// @param beside  becomes one entry for each node: the data that many stages need, in a third of the memory
void find_beside(const std::vector<GridNode>& nodes, std::vector<Beside>& beside);

/// Follows the links around a node. Two ways lead to each corner; if they reach different nodes, it is left out.
[[nodiscard]] Neighbourhood neighbourhood(std::span<const Beside> beside, std::int32_t node);

}  // namespace slsd
