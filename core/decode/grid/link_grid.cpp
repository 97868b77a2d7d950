// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/link_grid.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>

namespace slsd {
namespace {

/// How much a measured step may differ from the expected one before it is taken for a wrong link.
constexpr float kFrameChangeMax = 0.5F;

/// From a node to its neighbour, camera px.
Eigen::Vector2f link_vector(const std::vector<GridNode>& nodes, std::size_t from, Direction direction) {
  return nodes[nodes[from].links[direction]].centre_px - nodes[from].centre_px;
}

/// One step of the grid in a direction as the links beside a node show it, camera px.
std::optional<Eigen::Vector2f> measured_step(const std::vector<GridNode>& nodes,
                                             const std::vector<std::uint8_t>& trusted, std::size_t node,
                                             Direction forth) {
  const auto leads = [&](std::size_t from, Direction d) {
    return nodes[from].links[d] >= 0 && trusted[nodes[from].links[d]] != 0;
  };
  const Direction back = opposite(forth);
  if (leads(node, forth) && leads(node, back))
    return 0.5F * (link_vector(nodes, node, forth) - link_vector(nodes, node, back));
  if (!leads(node, forth) && !leads(node, back)) return std::nullopt;
  const Direction inwards = leads(node, forth) ? forth : back;
  const Eigen::Vector2f first = link_vector(nodes, node, inwards);
  const auto next = static_cast<std::size_t>(nodes[node].links[inwards]);
  // At the edge of a surface the steps shrink; the second one tells how fast.
  const Eigen::Vector2f step =
      leads(next, inwards) ? (1.5F * first - 0.5F * link_vector(nodes, next, inwards)).eval() : first;
  return inwards == forth ? step : (-step).eval();
}

/// Whether a node is so near to where the frame puts the neighbour that no other can be nearer.
bool is_evident(const std::vector<GridNode>& nodes, std::int32_t from, std::int32_t other, Direction direction,
                const Eigen::Matrix2f& cells_from_camera) {
  constexpr float kEvident = 0.15F;
  const Eigen::Vector2f there = nodes[other].centre_px - nodes[from].centre_px;
  return (cells_from_camera * there - step(direction)).squaredNorm() < kEvident * kEvident;
}

}  // namespace

void GridLinker::sort_into_buckets(const std::vector<GridNode>& nodes) {
  float step_px = 0;
  Eigen::Vector2f low = nodes[0].centre_px, high = low;
  for (const GridNode& node : nodes) {
    low = low.cwiseMin(node.centre_px);
    high = high.cwiseMax(node.centre_px);
    step_px = std::max({step_px, node.frame.col(0).norm(), node.frame.col(1).norm()});
  }
  // A bucket as wide as a cell: what is near a place is in two by two of them at the most.
  bucket_px_ = std::max(4.F, options_.pitch_px * step_px);
  origin_px_ = low;
  columns_ = static_cast<int>((high.x() - low.x()) / bucket_px_) + 1;
  rows_ = static_cast<int>((high.y() - low.y()) / bucket_px_) + 1;
  first_of_bucket_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  const auto bucket = [&](const GridNode& node) {
    const Eigen::Vector2f at = (node.centre_px - origin_px_) / bucket_px_;
    return static_cast<int>(at.y()) * columns_ + static_cast<int>(at.x());
  };
  for (const GridNode& node : nodes) ++first_of_bucket_[bucket(node) + 1];
  for (std::size_t i = 1; i < first_of_bucket_.size(); ++i) first_of_bucket_[i] += first_of_bucket_[i - 1];
  in_buckets_.resize(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {
    in_buckets_[--first_of_bucket_[bucket(nodes[i]) + 1]] = {nodes[i].centre_px, static_cast<std::int32_t>(i)};
  }
  // The counting sort has moved each bucket's end to its beginning.
  first_of_bucket_.erase(first_of_bucket_.begin());
  first_of_bucket_.push_back(static_cast<std::int32_t>(nodes.size()));
}

std::int32_t GridLinker::nearest(const std::vector<GridNode>& nodes, std::size_t from, Direction direction,
                                 const Eigen::Matrix2f& cells_from_camera, float radius) const {
  const GridNode& node = nodes[from];
  const Eigen::Vector2f target = node.centre_px + node.frame * (options_.pitch_px * step(direction));
  // An ellipse in the image; the frame's columns bound its box.
  const Eigen::Vector2f reach = radius * options_.pitch_px * node.frame.rowwise().norm();
  const Eigen::Array2f low = (target - reach - origin_px_) / bucket_px_,
                       high = (target + reach - origin_px_) / bucket_px_;
  const int left = std::max(static_cast<int>(low.x()), 0), right = std::min(static_cast<int>(high.x()), columns_ - 1);
  const int bottom = std::min(static_cast<int>(high.y()), rows_ - 1);
  std::int32_t best = -1;
  float best_squared = radius * radius;
  for (int row = std::max(static_cast<int>(low.y()), 0); row <= bottom && left <= right; ++row) {
    const std::int32_t end = first_of_bucket_[row * columns_ + right + 1];
    for (std::int32_t i = first_of_bucket_[row * columns_ + left]; i < end; ++i) {
      const auto& [centre_px, other] = in_buckets_[i];
      const float squared = (cells_from_camera * (centre_px - target)).squaredNorm();
      if (squared < best_squared && other != static_cast<std::int32_t>(from)) best_squared = squared, best = other;
    }
  }
  return best;
}

/// A node that is likely to be the neighbour: the one linked before, or the one that the links beside lead to.
std::int32_t GridLinker::likely(const Range& range, std::int32_t from, Direction direction) const {
  if (hints_[from][direction] >= 0) return hints_[from][direction];
  const Direction aside = direction == kDown ? kLeft : kUp;
  const std::int32_t beside = chosen_[from][aside];
  const std::int32_t corner = range.contains(beside) ? chosen_[beside][direction] : -1;
  return range.contains(corner) ? chosen_[corner][opposite(aside)] : -1;
}

void GridLinker::choose(const std::vector<GridNode>& nodes, const Range& range, std::int32_t from, float radius) {
  const Eigen::Matrix2f cells_from_camera = nodes[from].frame.inverse() / options_.pitch_px;
  for (const Direction d : {kUp, kLeft, kRight, kDown}) {
    std::int32_t other = likely(range, from, d);
    if (other < 0 || !is_evident(nodes, from, other, d, cells_from_camera))
      other = nearest(nodes, from, d, cells_from_camera, radius);
    chosen_[from][d] = other;
    if (range.contains(other) && hints_[other][opposite(d)] < 0) hints_[other][opposite(d)] = from;
  }
}

void GridLinker::find_mutual(std::vector<GridNode>& nodes, float radius, Executor& executor) {
  constexpr std::size_t kRange = 768;  // some rows of symbols: a row's help the next
  chosen_.assign(nodes.size(), {-1, -1, -1, -1});
  hints_.resize(nodes.size());
  relinked_.resize(nodes.size());
  executor.run_ranges(
      nodes.size(),
      [&](std::size_t first, std::size_t last, int) {
        const Range range{static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)};
        for (std::size_t i = first; i < last; ++i) hints_[i] = nodes[i].links;
        for (std::int32_t i = range.first; i < range.last; ++i) choose(nodes, range, i, radius);
      },
      kRange);
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      bool relinked = false;
      for (const Direction d : kDirections) {
        const std::int32_t other = chosen_[i][d];
        const std::int32_t link =
            other >= 0 && chosen_[other][opposite(d)] == static_cast<std::int32_t>(i) ? other : -1;
        relinked |= nodes[i].links[d] != link;
        nodes[i].links[d] = link;
      }
      relinked_[i] = relinked ? 1 : 0;
    }
  });
}

void GridLinker::measure_frame(std::vector<GridNode>& nodes, const std::vector<std::uint8_t>& trusted,
                               std::size_t node) const {
  for (const Direction d : {kRight, kDown}) {
    const auto step = measured_step(nodes, trusted, node, d);
    if (!step) continue;
    const Eigen::Vector2f measured = *step / options_.pitch_px;
    auto expected = nodes[node].frame.col(d == kRight ? 0 : 1);
    if ((measured - expected).norm() > kFrameChangeMax * expected.norm()) continue;
    expected = measured;
    (d == kRight ? nodes[node].measured_u : nodes[node].measured_v) = true;
  }
}

/// Those which the links that changed have a part in; a node that lost a link counts as one that has it.
void GridLinker::measure_changed_frames(std::vector<GridNode>& nodes) {
  for (std::size_t node = 0; node < nodes.size(); ++node) {
    if (relinked_[node] == 0) continue;
    visit_measured_with(nodes, static_cast<std::int32_t>(node), [&](std::int32_t other) {
      measure_frame(nodes, all_trusted_, static_cast<std::size_t>(other));
    });
  }
}

/// Whether the same step behind and before a link, or most of those behind, before and on both sides, disagree with it.
/// Along a straight edge in depth the links on both sides agree with it; those behind and before do not.
bool GridLinker::is_inconsistent(const std::vector<GridNode>& nodes, std::size_t from, Direction d,
                                 const Eigen::Matrix2f& cells_from_camera) const {
  const Eigen::Vector2f own = link_vector(nodes, from, d);
  const auto is_torn = [&](std::size_t node) { return nodes[node].torn || nodes[nodes[node].links[d]].torn; };
  const bool own_torn = is_torn(from);
  int count = 0, against = 0;
  const auto ask = [&](std::int32_t other) {
    if (other < 0 || nodes[other].links[d] < 0) return;
    if (!own_torn && is_torn(static_cast<std::size_t>(other))) return;
    const Eigen::Vector2f difference = own - link_vector(nodes, static_cast<std::size_t>(other), d);
    ++count;
    against += (cells_from_camera * difference).squaredNorm() > options_.deviation_max * options_.deviation_max;
  };
  ask(nodes[from].links[opposite(d)]);
  ask(nodes[from].links[d]);
  if (against == 2) return true;
  ask(nodes[from].links[(d + 1) % 4]);
  ask(nodes[from].links[(d + 3) % 4]);
  return 2 * against > count;
}

void GridLinker::break_inconsistent(std::vector<GridNode>& nodes, Executor& executor) {
  inconsistent_.assign(nodes.size(), {});
  // Each link is asked about once, as links are mutual, and by one of its ends.
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const Eigen::Matrix2f cells_from_camera = nodes[i].frame.inverse() / options_.pitch_px;
      for (const Direction d : {kRight, kDown}) {
        const std::int32_t other = nodes[i].links[d];
        if (other >= 0 && is_inconsistent(nodes, i, d, cells_from_camera))
          inconsistent_[i][d] = inconsistent_[other][opposite(d)] = true;
      }
    }
  });
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i].broken = inconsistent_[i];
}

void GridLinker::link(std::vector<GridNode>& nodes, Executor& executor) {
  if (nodes.empty()) return;
  sort_into_buckets(nodes);
  all_trusted_.assign(nodes.size(), 1);
  find_mutual(nodes, options_.search_radius, executor);
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) measure_frame(nodes, all_trusted_, i);
  });
  find_mutual(nodes, options_.refined_radius, executor);
  measure_changed_frames(nodes);
  break_inconsistent(nodes, executor);
}

}  // namespace slsd
