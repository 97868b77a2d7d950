// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/evidence_flow.hpp"

#include <algorithm>

namespace slsd {
namespace {

constexpr float kNothing = 1e-4F;  // nats
/// Largest number of nodes that a search reaches: nodes farther away hardly add to a margin that nearer ones lack.
constexpr std::size_t kSearchedNodes = 80;
constexpr std::uint8_t kFirst = 4;

}  // namespace

void EvidenceFlow::clear(std::span<const Beside> beside) {
  beside_ = beside;
  supply_.assign(beside.size(), 0);
  capacity_.assign(beside.size(), {});
  line_.assign(beside.size(), {-1, -1, -1, -1});
  lines_.clear();
  reached_in_.assign(beside.size(), 0);
  came_by_.resize(beside.size());
  sides_.resize(beside.size());
  search_ = 0;
}

std::int32_t EvidenceFlow::add_line(float nats) {
  lines_.push_back({nats, nats});
  return static_cast<std::int32_t>(lines_.size()) - 1;
}

void EvidenceFlow::keep() {
  kept_supply_ = supply_, kept_capacity_ = capacity_, kept_lines_ = lines_;
  touched_.clear(), touched_lines_.clear();
}

void EvidenceFlow::restore() {
  for (const std::int32_t node : touched_) supply_[node] = kept_supply_[node], capacity_[node] = kept_capacity_[node];
  for (const std::int32_t line : touched_lines_) lines_[line] = kept_lines_[line];
  touched_.clear(), touched_lines_.clear();
}

/// The most that can flow from a source that the last search reached.
float EvidenceFlow::most_from(std::int32_t source, std::int32_t node, float wanted, const Budget& budget) const {
  float most = std::min(supply_[source], wanted);
  if (source == node) return most;
  most = std::min(most, budget.all);
  if ((sides_[source] & kAlongRow) != 0) most = std::min(most, budget.row);
  if ((sides_[source] & kAlongColumn) != 0) most = std::min(most, budget.column);
  for (std::int32_t to = source; came_by_[to] != kFirst;) {
    const auto d = static_cast<Direction>(came_by_[to]);
    const std::int32_t from = beside_[to][opposite(d)];
    most = std::min(most, capacity_[from][d]);
    if (const std::int32_t line = line_[from][d]; line >= 0) most = std::min(most, lines_[line][d / 2]);
    to = from;
  }
  return most;
}

void EvidenceFlow::push(std::int32_t source, float nats) {
  supply_[source] -= nats;
  touched_.push_back(source);
  for (std::int32_t to = source; came_by_[to] != kFirst;) {
    const auto d = static_cast<Direction>(came_by_[to]);
    const std::int32_t from = beside_[to][opposite(d)];
    capacity_[from][d] -= nats, capacity_[to][opposite(d)] += nats;
    touched_.push_back(from);
    if (const std::int32_t line = line_[from][d]; line >= 0) {
      lines_[line][d / 2] -= nats, lines_[line][1 - d / 2] += nats;
      touched_lines_.push_back(line);
    }
    to = from;
  }
}

/// One search, nearest supplies first.
float EvidenceFlow::draw_once(std::int32_t node, float wanted, Budget& budget) {
  ++search_;
  queue_.assign(1, node);
  reached_in_[node] = search_, came_by_[node] = kFirst, sides_[node] = 0;
  float drawn = 0;
  for (std::size_t next = 0; next < queue_.size() && next < kSearchedNodes; ++next) {
    const std::int32_t at = queue_[next];
    if (supply_[at] > kNothing) {
      const float nats = most_from(at, node, wanted - drawn, budget);
      if (nats > kNothing) {
        push(at, nats);
        drawn += nats;
        if (at != node) budget.all -= nats;
        if ((sides_[at] & kAlongRow) != 0) budget.row -= nats;
        if ((sides_[at] & kAlongColumn) != 0) budget.column -= nats;
        if (drawn >= wanted - kNothing) return drawn;
      }
    }
    if (budget.all <= kNothing) return drawn;
    for (const Direction d : kDirections) {
      const std::int32_t other = beside_[at][d];
      if (other < 0 || capacity_[at][d] <= kNothing || reached_in_[other] == search_) continue;
      if (const std::int32_t line = line_[at][d]; line >= 0 && lines_[line][d / 2] <= kNothing) continue;
      const auto sides = static_cast<std::uint8_t>(sides_[at] | (d % 2 == 0 ? kAlongRow : kAlongColumn));
      if ((sides & kAlongRow) != 0 && budget.row <= kNothing) continue;
      if ((sides & kAlongColumn) != 0 && budget.column <= kNothing) continue;
      reached_in_[other] = search_, came_by_[other] = d, sides_[other] = sides;
      queue_.push_back(other);
    }
  }
  return drawn;
}

void EvidenceFlow::reserve() {
  for (std::vector<std::int32_t>* buffer : {&queue_, &touched_, &touched_lines_}) buffer->reserve(supply_.size());
}

float EvidenceFlow::draw(std::int32_t node, float wanted, Budget budget) {
  float drawn = 0;
  while (drawn < wanted - kNothing) {
    const float more = draw_once(node, wanted - drawn, budget);
    if (more <= kNothing) break;
    drawn += more;
  }
  return drawn;
}

}  // namespace slsd
