// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {

void find_beside(const std::vector<GridNode>& nodes, std::vector<Beside>& beside) {
  beside.resize(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const GridNode& node = nodes[i];
    for (const Direction d : kDirections) beside[i][d] = node.broken[d] ? -1 : node.links[d];
  }
}

Neighbourhood neighbourhood(std::span<const Beside> beside, std::int32_t node) {
  static constexpr Beside kNothing{-1, -1, -1, -1};
  const auto around = [&](std::int32_t from) -> const Beside& { return from < 0 ? kNothing : beside[from]; };
  const auto [right, down, left, up] = beside[node];
  const Beside &of_right = around(right), &of_down = around(down), &of_left = around(left), &of_up = around(up);
  const auto corner = [](std::int32_t one, std::int32_t other) {
    if (one >= 0 && other >= 0 && one != other) return std::int32_t{-1};
    return one >= 0 ? one : other;
  };
  return {corner(of_up[kLeft], of_left[kUp]),     up,   corner(of_up[kRight], of_right[kUp]),    left, node, right,
          corner(of_down[kLeft], of_left[kDown]), down, corner(of_down[kRight], of_right[kDown])};
}

}  // namespace slsd
