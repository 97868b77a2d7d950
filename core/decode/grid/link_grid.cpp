// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/link_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Largest change of a measured step relative to the expected one, as a share; beyond it the link is wrong.
constexpr float kFrameChangeMax = 0.5F;
/// Distance from the expected place, of the pitch, within which a node is certainly the neighbour: no other can be
/// nearer.
constexpr float kEvident = 0.15F;

/// Vector from a node to its neighbour, camera px.
Eigen::Vector2f link_vector(const std::vector<GridNode>& nodes, std::size_t from, Direction direction) {
  return nodes[nodes[from].links[direction]].centre_px - nodes[from].centre_px;
}

/// One step of the grid in a direction, from the links beside a node, camera px.
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
  // At the edge of a surface the steps shrink; a second step shows how fast.
  const Eigen::Vector2f step =
      leads(next, inwards) ? (1.5F * first - 0.5F * link_vector(nodes, next, inwards)).eval() : first;
  return inwards == forth ? step : (-step).eval();
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
  // Buckets as wide as a cell: the neighbourhood of a place covers at most two by two of them.
  per_bucket_px_ = 1 / std::max(4.F, options_.pitch_px * step_px);
  origin_px_ = low;
  columns_ = static_cast<int>((high.x() - low.x()) * per_bucket_px_) + 1;
  rows_ = static_cast<int>((high.y() - low.y()) * per_bucket_px_) + 1;
  first_of_bucket_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  const auto bucket = [&](const GridNode& node) {
    const Eigen::Vector2f at = (node.centre_px - origin_px_) * per_bucket_px_;
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
  const auto squared_cells = [&](const Eigen::Vector2f& centre_px) {
    return (cells_from_camera * (centre_px - target)).squaredNorm();
  };
  // Most nodes lie where they are expected.
  const Eigen::Array2f at = (target - origin_px_) * per_bucket_px_;
  if (at.x() >= 0 && at.y() >= 0 && at.x() < static_cast<float>(columns_) && at.y() < static_cast<float>(rows_)) {
    const int bucket = static_cast<int>(at.y()) * columns_ + static_cast<int>(at.x());
    for (std::int32_t i = first_of_bucket_[bucket]; i < first_of_bucket_[bucket + 1]; ++i) {
      const auto& [centre_px, other] = in_buckets_[i];
      if (other != static_cast<std::int32_t>(from) && squared_cells(centre_px) < kEvident * kEvident) return other;
    }
  }
  // An ellipse in the image; the frame's columns bound its box.
  const Eigen::Vector2f reach = radius * options_.pitch_px * node.frame.rowwise().norm();
  const Eigen::Array2f low = (target - reach - origin_px_) * per_bucket_px_,
                       high = (target + reach - origin_px_) * per_bucket_px_;
  const int left = std::max(static_cast<int>(low.x()), 0), right = std::min(static_cast<int>(high.x()), columns_ - 1);
  const int bottom = std::min(static_cast<int>(high.y()), rows_ - 1);
  std::int32_t best = -1;
  float best_squared = radius * radius;
  for (int row = std::max(static_cast<int>(low.y()), 0); row <= bottom && left <= right; ++row) {
    const std::int32_t end = first_of_bucket_[row * columns_ + right + 1];
    for (std::int32_t i = first_of_bucket_[row * columns_ + left]; i < end; ++i) {
      const auto& [centre_px, other] = in_buckets_[i];
      const float squared = squared_cells(centre_px);
      if (squared >= best_squared || other == static_cast<std::int32_t>(from)) continue;
      if (squared < kEvident * kEvident) return other;
      best_squared = squared, best = other;
    }
  }
  return best;
}

/// Likely neighbours of a node: those linked before, or those that the links beside lead to; -1: none.
GridLinker::Links GridLinker::likely(const Range& range, std::int32_t from) const {
  Links likely = hints_[from];
  for (const Direction d : {kLeft, kRight, kDown}) {
    if (likely[d] >= 0) continue;
    const Direction aside = d == kDown ? kLeft : kUp;
    const std::int32_t beside = likely[aside];
    const std::int32_t corner = range.contains(beside) ? chosen_[beside][d] : -1;
    if (range.contains(corner)) likely[d] = chosen_[corner][opposite(aside)];
  }
  return likely;
}

/// Finds the nodes so near to the neighbours' expected places that no others can be nearer: bits by Direction.
unsigned GridLinker::find_evident(const std::vector<GridNode>& nodes, std::int32_t from, const Links& others,
                                  const Eigen::Matrix2f& cells_from_camera) {
  constexpr FourLanes kStepX = {1, 0, -1, 0}, kStepY = {0, 1, 0, -1};
  const auto centre_of = [&](Direction d) -> const Eigen::Vector2f& {
    return nodes[others[d] < 0 ? from : others[d]].centre_px;
  };
  const Eigen::Vector2f &one = centre_of(kRight), &two = centre_of(kDown), &three = centre_of(kLeft),
                        &four = centre_of(kUp), &own = nodes[from].centre_px;
  const FourLanes x = FourLanes{one.x(), two.x(), three.x(), four.x()} - own.x(),
                  y = FourLanes{one.y(), two.y(), three.y(), four.y()} - own.y();
  const FourLanes right = cells_from_camera(0, 0) * x + cells_from_camera(0, 1) * y - kStepX,
                  down = cells_from_camera(1, 0) * x + cells_from_camera(1, 1) * y - kStepY;
  return bits_of(right * right + down * down < kEvident * kEvident);
}

void GridLinker::choose(const std::vector<GridNode>& nodes, const Range& range, std::int32_t from, float radius) {
  const Eigen::Matrix2f cells_from_camera = nodes[from].frame.inverse() / options_.pitch_px;
  Links chosen = likely(range, from);
  const unsigned evident = find_evident(nodes, from, chosen, cells_from_camera);
  bool changed = false;
  for (const Direction d : kDirections) {
    if ((evident >> static_cast<unsigned>(d) & 1U) == 0) chosen[d] = nearest(nodes, from, d, cells_from_camera, radius);
    changed |= chosen[d] != nodes[from].links[d];
    if (range.contains(chosen[d])) {
      std::int32_t& hint = hints_[chosen[d]][opposite(d)];
      if (hint < 0) hint = from;
    }
  }
  chosen_[from] = chosen;
  changed_[from] = static_cast<std::uint8_t>(changed);
}

void GridLinker::find_mutual(std::vector<GridNode>& nodes, float radius, Executor& executor) {
  constexpr std::size_t kRange = 768;  // several rows of symbols: each row's links help with the next
  chosen_.assign(nodes.size(), {-1, -1, -1, -1});
  hints_.resize(nodes.size());
  changed_.resize(nodes.size());
  relinked_.resize(nodes.size());
  executor.run_ranges(
      nodes.size(),
      [&](std::size_t first, std::size_t last, int) {
        const Range range{static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)};
        for (std::size_t i = first; i < last; ++i) hints_[i] = nodes[i].links;
        for (std::int32_t i = range.first; i < range.last; ++i) choose(nodes, range, i, radius);
      },
      kRange);
  const auto has_changed = [&](std::int32_t node) { return node >= 0 && changed_[node] != 0; };
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      relinked_[i] = 0;
      // Links between nodes that have not changed are still mutual.
      if (changed_[i] == 0 && std::ranges::none_of(chosen_[i], has_changed)) continue;
      for (const Direction d : kDirections) {
        const std::int32_t other = chosen_[i][d];
        const std::int32_t link =
            other >= 0 && chosen_[other][opposite(d)] == static_cast<std::int32_t>(i) ? other : -1;
        relinked_[i] |= static_cast<std::uint8_t>(nodes[i].links[d] != link);
        nodes[i].links[d] = link;
      }
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

/// Measures the frames that use a changed link. A node that lost a link has changed as well.
void GridLinker::measure_changed_frames(std::vector<GridNode>& nodes) {
  for (std::size_t node = 0; node < nodes.size(); ++node) {
    if (relinked_[node] == 0) continue;
    visit_measured_with(nodes, static_cast<std::int32_t>(node), [&](std::int32_t other) {
      measure_frame(nodes, all_trusted_, static_cast<std::size_t>(other));
    });
  }
}

void GridLinker::measure_steps(const std::vector<GridNode>& nodes, Executor& executor) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  steps_.resize(nodes.size() + 1);
  steps_.back().fill(kNone);
  sound_steps_ = steps_;
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      for (const Direction d : {kRight, kDown}) {
        const std::int32_t other = nodes[i].links[d];
        const std::size_t x = 2 * static_cast<std::size_t>(d), y = x + 1;
        const Eigen::Vector2f step_px = other < 0 ? Eigen::Vector2f(kNone, kNone) : link_vector(nodes, i, d);
        const bool split = nodes[i].split || (other >= 0 && nodes[other].split);
        steps_[i][x] = step_px.x(), steps_[i][y] = step_px.y();
        sound_steps_[i][x] = split ? kNone : step_px.x(), sound_steps_[i][y] = split ? kNone : step_px.y();
      }
    }
  });
}

/// Finds links that disagree with the same step behind and ahead, or with most of the steps behind, ahead and on both
/// sides. Along a straight edge in depth, the links on both sides agree; those behind and ahead do not. Links of split
/// shapes are compared only with each other.
/// @return one bit for the link to the right, and one for the link down
unsigned GridLinker::find_inconsistent(const GridNode& node, std::size_t index) const {
  const auto load = [](const std::vector<std::array<float, 4>>& from, std::size_t at) {
    return std::bit_cast<FourLanes>(from[at]);
  };
  const FourLanes own = load(steps_, index), own_sound = load(sound_steps_, index);
  const FourIntLanes is_split = own_sound != own_sound;
  const Eigen::Matrix2f cells_from_camera = node.frame.inverse() / options_.pitch_px;
  const float xx = cells_from_camera(0, 0), xy = cells_from_camera(0, 1), yx = cells_from_camera(1, 0),
              yy = cells_from_camera(1, 1);
  const FourLanes from_x = {xx, yx, xx, yx}, from_y = {xy, yy, xy, yy};
  FourIntLanes count{};  // negative, as a true comparison gives -1
  const auto find_against = [&](Direction d) -> FourIntLanes {
    const std::size_t other = node.links[d] < 0 ? steps_.size() - 1 : static_cast<std::size_t>(node.links[d]);
    const FourLanes difference = own - (is_split ? load(steps_, other) : load(sound_steps_, other));
    const FourLanes cells = from_x * __builtin_shufflevector(difference, difference, 0, 0, 2, 2) +
                            from_y * __builtin_shufflevector(difference, difference, 1, 1, 3, 3);
    const FourLanes squared = cells * cells;
    count += difference == difference;
    return squared + __builtin_shufflevector(squared, squared, 1, 0, 3, 2) >
           options_.deviation_max * options_.deviation_max;
  };
  const FourIntLanes right_or_left = find_against(kRight) + find_against(kLeft),
                     down_or_up = find_against(kDown) + find_against(kUp);
  const FourIntLanes along = __builtin_shufflevector(right_or_left, down_or_up, 0, 1, 6, 7);
  const unsigned bits = bits_of((along == -2) | (2 * (right_or_left + down_or_up) < count));
  return (bits & 1U) | (bits >> 1U & 2U);
}

void GridLinker::break_inconsistent(std::vector<GridNode>& nodes, Executor& executor) {
  measure_steps(nodes, executor);
  inconsistent_.assign(nodes.size(), {});
  // Ask about each link once, from one of its ends: links are mutual.
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const unsigned inconsistent = find_inconsistent(nodes[i], i);
      if (inconsistent == 0) continue;
      for (const Direction d : {kRight, kDown}) {
        if ((inconsistent >> static_cast<unsigned>(d) & 1U) != 0)
          inconsistent_[i][d] = inconsistent_[nodes[i].links[d]][opposite(d)] = true;
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
