// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/link_grid.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>

namespace slsd {
namespace {

constexpr Direction kDirections[] = {kRight, kDown, kLeft, kUp};

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

/// Whether a neighbour is so near to where the frame puts it that no other can be nearer.
bool is_evident(const std::vector<GridNode>& nodes, std::size_t from, Direction direction,
                const Eigen::Matrix2f& cells_from_camera) {
  constexpr float kEvident = 0.15F;
  return (cells_from_camera * link_vector(nodes, from, direction) - step(direction)).squaredNorm() <
         kEvident * kEvident;
}

}  // namespace

Eigen::Vector2f step(Direction direction) {
  switch (direction) {
    case kRight:
      return {1, 0};
    case kDown:
      return {0, 1};
    case kLeft:
      return {-1, 0};
    case kUp:
      break;
  }
  return {0, -1};
}

void GridLinker::sort_into_buckets(const std::vector<GridNode>& nodes) {
  float step_px = 0;
  Eigen::Vector2f low = nodes[0].centre_px, high = low;
  for (const GridNode& node : nodes) {
    low = low.cwiseMin(node.centre_px);
    high = high.cwiseMax(node.centre_px);
    step_px = std::max({step_px, node.frame.col(0).norm(), node.frame.col(1).norm()});
  }
  // A bucket as wide as the search: the neighbours of a place are in three by three of them.
  bucket_px_ = std::max(4.F, options_.pitch_px * step_px * options_.search_radius);
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
  for (std::size_t i = nodes.size(); i-- > 0;)
    in_buckets_[--first_of_bucket_[bucket(nodes[i]) + 1]] = static_cast<std::int32_t>(i);
  // The counting sort has moved each bucket's end to its beginning.
  first_of_bucket_.erase(first_of_bucket_.begin());
  first_of_bucket_.push_back(static_cast<std::int32_t>(nodes.size()));
}

std::int32_t GridLinker::nearest(const std::vector<GridNode>& nodes, std::size_t from, Direction direction,
                                 const Eigen::Matrix2f& cells_from_camera, float radius) const {
  const GridNode& node = nodes[from];
  const Eigen::Vector2f target = node.centre_px + node.frame * (options_.pitch_px * step(direction));
  const Eigen::Vector2f at = (target - origin_px_) / bucket_px_;
  const int column = static_cast<int>(std::floor(at.x())), row = static_cast<int>(std::floor(at.y()));
  std::int32_t best = -1;
  float best_squared = radius * radius;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
      const int bucket = r * columns_ + c;
      for (int i = first_of_bucket_[bucket]; i < first_of_bucket_[bucket + 1]; ++i) {
        const std::int32_t other = in_buckets_[i];
        const float squared = (cells_from_camera * (nodes[other].centre_px - target)).squaredNorm();
        if (squared < best_squared && other != static_cast<std::int32_t>(from)) best_squared = squared, best = other;
      }
    }
  }
  return best;
}

void GridLinker::find_mutual(std::vector<GridNode>& nodes, float radius) {
  chosen_.resize(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Eigen::Matrix2f cells_from_camera = nodes[i].frame.inverse() / options_.pitch_px;
    for (const Direction d : kDirections) {
      const bool kept = nodes[i].links[d] >= 0 && is_evident(nodes, i, d, cells_from_camera);
      chosen_[i][d] = kept ? nodes[i].links[d] : nearest(nodes, i, d, cells_from_camera, radius);
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Direction d : kDirections) {
      const std::int32_t other = chosen_[i][d];
      nodes[i].links[d] = other >= 0 && chosen_[other][opposite(d)] == static_cast<std::int32_t>(i) ? other : -1;
    }
  }
}

void GridLinker::measure_frames(std::vector<GridNode>& nodes, const std::vector<std::uint8_t>& trusted) const {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    GridNode& node = nodes[i];
    for (const Direction d : {kRight, kDown}) {
      const auto step = measured_step(nodes, trusted, i, d);
      if (!step) continue;
      const Eigen::Vector2f measured = *step / options_.pitch_px;
      auto expected = node.frame.col(d == kRight ? 0 : 1);
      if ((measured - expected).norm() > kFrameChangeMax * expected.norm()) continue;
      expected = measured;
      (d == kRight ? node.measured_u : node.measured_v) = true;
    }
  }
}

void GridLinker::break_inconsistent(std::vector<GridNode>& nodes) {
  inconsistent_.assign(nodes.size(), {});
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Direction d : {kRight, kDown}) {
      const std::int32_t other = nodes[i].links[d];
      if (other < 0) continue;
      // The same step behind, before, and on both sides of this one.
      std::array<Eigen::Vector2f, 4> parallel;
      int count = 0;
      const auto add = [&](std::int32_t from) {
        if (from >= 0 && nodes[from].links[d] >= 0)
          parallel[count++] = link_vector(nodes, static_cast<std::size_t>(from), d);
      };
      add(nodes[i].links[opposite(d)]);
      add(other);
      add(nodes[i].links[(d + 1) % 4]);
      add(nodes[i].links[(d + 3) % 4]);
      if (count == 0) continue;
      const Eigen::Vector2f own = link_vector(nodes, i, d);
      const Eigen::Matrix2f cells_from_camera = nodes[i].frame.inverse() / options_.pitch_px;
      int against = 0;
      for (int k = 0; k < count; ++k) {
        against +=
            (cells_from_camera * (own - parallel[k])).squaredNorm() > options_.deviation_max * options_.deviation_max;
      }
      if (2 * against > count) inconsistent_[i][d] = inconsistent_[other][opposite(d)] = true;
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Direction d : kDirections) {
      nodes[i].broken[d] = inconsistent_[i][d];
    }
  }
}

void GridLinker::link(std::vector<GridNode>& nodes) {
  if (nodes.empty()) return;
  sort_into_buckets(nodes);
  all_trusted_.assign(nodes.size(), 1);
  find_mutual(nodes, options_.search_radius);
  measure_frames(nodes, all_trusted_);
  find_mutual(nodes, options_.refined_radius);
  measure_frames(nodes, all_trusted_);
  break_inconsistent(nodes);
}

}  // namespace slsd
