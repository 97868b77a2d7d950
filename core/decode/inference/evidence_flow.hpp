// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {

/// Evidence that flows along links. The most that can reach a node, in nats, is the minimum cut between the node and
/// the letters around it (Ford and Fulkerson 1956).
///
/// Each node has a supply, each link a capacity. A straight edge crosses many links in one event, so those links share
/// the capacity of their line. Draws use up supply and capacity until restore().
/// @thread thread-bound: keeps its buffers
class EvidenceFlow {
 public:
  /// Limits on the nats that a node draws from others: in all, along its row and along its column.
  struct Budget {
    float all, row, column;
  };
  static constexpr Budget kUnlimited{1e9F, 1e9F, 1e9F};

  /// Starts anew, without any supply or capacity.
  void clear(std::span<const Beside> beside);
  void set_supply(std::size_t node, float nats) { supply_[node] = nats; }
  void set_capacity(std::size_t node, Direction d, float nats) { capacity_[node][d] = nats; }
  /// @return  the number of a line without links
  std::int32_t add_line(float nats);
  void set_line(std::int32_t line, float nats) { lines_[line] = {nats, nats}; }
  void put_on_line(std::size_t node, Direction d, std::int32_t line) { line_[node][d] = line; }
  [[nodiscard]] std::int32_t line_of(std::size_t node, Direction d) const { return line_[node][d]; }

  [[nodiscard]] float capacity_left(std::size_t node, Direction d) const { return capacity_[node][d]; }
  [[nodiscard]] float line_left(std::int32_t line, Direction d) const { return lines_[line][d / 2]; }
  void take_from_line(std::int32_t line, Direction d, float nats) { lines_[line][d / 2] -= nats; }

  /// Draws up to `wanted` nats to a node.
  /// @return  the nats drawn
  float draw(std::int32_t node, float wanted, Budget budget = kUnlimited);

  /// Makes room for searches: a copy has none.
  void reserve();
  /// Saves what is left, and restores it after draws.
  void keep();
  void restore();

 private:
  enum Sides : std::uint8_t { kAlongRow = 1, kAlongColumn = 2 };
  void reach(std::int32_t node);
  float draw_once(std::int32_t node, float wanted, Budget& budget);
  [[nodiscard]] float most_from(std::int32_t source, std::int32_t node, float wanted, const Budget& budget) const;
  void push(std::int32_t source, float nats);

  std::span<const Beside> beside_;
  std::vector<float> supply_, kept_supply_;
  std::vector<std::array<float, 4>> capacity_, kept_capacity_;  // capacity left towards the node at a link's other end
  std::vector<std::array<std::int32_t, 4>> line_;
  std::vector<std::array<float, 2>> lines_, kept_lines_;  // right or down, and left or up
  std::vector<std::int32_t> touched_, touched_lines_;
  std::vector<std::int32_t> queue_, reached_in_;  // number of the search that reached each node last
  std::vector<std::uint8_t> came_by_, sides_;     // for each node: the link that led to it, and the directions of its
                                                  // path
  std::int32_t search_ = 0;
};

}  // namespace slsd
