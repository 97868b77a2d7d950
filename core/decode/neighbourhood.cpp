// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/neighbourhood.hpp"

namespace slsd {

Neighbourhood neighbourhood(const std::vector<GridNode>& nodes, std::int32_t node) {
  const auto next = [&](std::int32_t from, Direction direction) { return neighbour(nodes, from, direction); };
  const std::int32_t up = next(node, kUp), down = next(node, kDown), left = next(node, kLeft),
                     right = next(node, kRight);
  const auto corner = [&](std::int32_t vertical, Direction sideways, std::int32_t horizontal, Direction updown) {
    const std::int32_t one = next(vertical, sideways), other = next(horizontal, updown);
    if (one >= 0 && other >= 0 && one != other) return std::int32_t{-1};
    return one >= 0 ? one : other;
  };
  return {corner(up, kLeft, left, kUp),     up,   corner(up, kRight, right, kUp),    left, node, right,
          corner(down, kLeft, left, kDown), down, corner(down, kRight, right, kDown)};
}

}  // namespace slsd
