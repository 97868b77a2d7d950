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

/// Finds the neighbour in a direction if it is decoded as the cell that lies there; -1 otherwise.
[[nodiscard]] inline std::int32_t decoded_beside(const std::vector<GridNode>& nodes,
                                                 const std::vector<CellClaim>& claims, std::int32_t node,
                                                 Direction direction) {
  const std::int32_t other = neighbour(nodes, node, direction);
  if (other < 0 || claims[other].status != RegionStatus::kDecoded) return -1;
  return claims[node].fits(claims[other], direction) ? other : -1;
}

/// A node's neighbours along links that are not broken, by Direction; -1 where there is none.
using Beside = std::array<std::int32_t, 4>;

/// @param beside  becomes one to a node: what many steps ask for, in a third of the memory
void find_beside(const std::vector<GridNode>& nodes, std::vector<Beside>& beside);

/// Follows the links around a node. A corner can be reached by two ways; where they lead to different nodes it is left
/// out.
[[nodiscard]] Neighbourhood neighbourhood(std::span<const Beside> beside, std::int32_t node);

}  // namespace slsd
