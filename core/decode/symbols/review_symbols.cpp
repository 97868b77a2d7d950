// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/review_symbols.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/LU>

#include "core/decode/grid/neighbourhood.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Increase of a symbol's distance from its letter that levelling the light may cause: its centre improves even so.
constexpr float kLevellingTolerance = 0.3F;

/// Tells whether review measures a node. An aligned one already has its place.
bool is_reviewed(const Sightings& seen, std::size_t node) {
  return seen.claims[node].status == RegionStatus::kDecoded && !is_aligned(seen.aligned[node]);
}

float light_of(const Sightings& seen, std::int32_t node) {
  return seen.moments[node].peak - seen.moments[node].background;
}

/// Relative change of the light from one cell to the next in a direction, from the peaks of the neighbours. At the edge
/// of a surface the change grows; a second neighbour shows how fast.
float light_change(const Sightings& seen, std::size_t node, Direction direction) {
  const auto self = static_cast<std::int32_t>(node);
  const std::int32_t next = neighbour(seen.nodes, self, direction),
                     last = neighbour(seen.nodes, self, opposite(direction));
  const float own = light_of(seen, self);
  if (next >= 0 && last >= 0) return (light_of(seen, next) - light_of(seen, last)) / (2 * own);
  if (next < 0 && last < 0) return 0;
  const Direction inwards = next >= 0 ? direction : opposite(direction);
  const std::int32_t first = next >= 0 ? next : last, second = neighbour(seen.nodes, first, inwards);
  const float step = light_of(seen, first) - own;
  const float change = second >= 0 ? 1.5F * step - 0.5F * (light_of(seen, second) - light_of(seen, first)) : step;
  return (inwards == direction ? change : -change) / own;
}

/// Centre that the neighbours predict for a node, by continuing their steps quadratically, as steps shrink towards a
/// limb.
std::optional<Eigen::Vector2f> centre_from_neighbours(const std::vector<GridNode>& nodes, std::size_t node) {
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  int count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t first = neighbour(nodes, static_cast<std::int32_t>(node), d);
    const std::int32_t second = neighbour(nodes, first, d), third = neighbour(nodes, second, d);
    if (third < 0) continue;
    sum += 3 * nodes[first].centre_px - 3 * nodes[second].centre_px + nodes[third].centre_px;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<float>(count);
}

}  // namespace

SymbolReview::SymbolReview(const IndexedPattern& indexed, ReviewOptions options)
    : array_(indexed.array()),
      size_px_(static_cast<float>(indexed.pattern().options.symbol_size_px)),
      pitch_px_(static_cast<float>(indexed.pattern().pitch_px())),
      options_(options) {}

/// Mean of the frames of a symbol and of those around it whose cells fit, up to two links away.
std::optional<LatticeFrame> SymbolReview::frame_around(const Sightings& seen, std::size_t node) const {
  LatticeFrame sum = seen.nodes[node].frame;
  float count = 1;
  const auto add = [&](std::int32_t from, Direction d) -> std::int32_t {
    const std::int32_t other = neighbour(seen.nodes, from, d);
    if (other < 0 || decoded_[other] == 0 || !seen.claims[from].fits(seen.claims[other], d)) return -1;
    if (seen.nodes[other].measured_u && seen.nodes[other].measured_v) sum += seen.nodes[other].frame, ++count;
    return other;
  };
  for (const Direction d : kDirections) {
    const std::int32_t other = add(static_cast<std::int32_t>(node), d);
    if (other < 0) continue;
    add(other, d);
    add(other, across(d, 1));
  }
  if (count == 1) return std::nullopt;
  return sum / count;
}

float SymbolReview::distance_in(const Sightings& seen, std::size_t node, const GreyMoments& moments,
                                const LatticeFrame& lattice_frame) const {
  return std::sqrt(
      prototype_of(seen.claims[node]).squared_distance(shape_features(moments, lattice_frame.inverse(), size_px_)));
}

float SymbolReview::distance_from_letter(const Sightings& seen, std::size_t node, const GreyMoments& moments) const {
  return nearer_around(seen, node, moments, distance_in(seen, node, moments, seen.nodes[node].frame));
}

/// Compares the distances in both frames: if print has displaced centres, a symbol's own frame is worse than the mean
/// of those around it. A symbol off the
/// grid lies on another surface with another frame, and the distance shows that.
/// @param own  the distance in the symbol's own frame
float SymbolReview::nearer_around(const Sightings& seen, std::size_t node, const GreyMoments& moments,
                                  float own) const {
  if (own < options_.doubtful_distance || seen.claims[node].grid_fit == GridFit::kNone) return own;
  const auto around = frame_around(seen, node);
  return around ? std::min(own, distance_in(seen, node, moments, *around)) : own;
}

/// distance_from_letter() of all trusted symbols.
void SymbolReview::measure_distances(const Classifier& letters, Executor& executor, Sightings& seen) {
  executor.run_ranges(seen.size(), [&](std::size_t first, std::size_t last, int) {
    std::array<std::size_t, kLanes> asked;
    std::size_t count = 0;
    EightMoments eight;
    EightShapes shapes;
    Classifier::EightDistances squared;
    for (std::size_t i = first; i < last; ++i) {
      if (trusted_[i] != 0) {
        eight.set(static_cast<int>(count), seen.moments[i], seen.nodes[i].frame.inverse());
        asked[count++] = i;
      }
      const bool is_last = i + 1 == last;
      if (count < kLanes && !(is_last && count > 0)) continue;
      find_features(eight, size_px_, shapes);
      letters.find_squared_distances(shapes, squared);
      for (std::size_t lane = 0; lane < count; ++lane) {
        const std::size_t node = asked[lane];
        const CellClaim& claim = seen.claims[node];
        const float own = std::sqrt(squared.of[array_->at(claim.row, claim.column)][lane]);
        seen.misfits[node] = nearer_around(seen, node, seen.moments[node], own);
      }
      count = 0;
    }
  });
}

bool SymbolReview::is_inside(const Sightings& seen, std::size_t node) const {
  return std::ranges::all_of(kDirections, [&](Direction d) {
    const std::int32_t other = neighbour(seen.nodes, static_cast<std::int32_t>(node), d);
    return other >= 0 && seen.claims[other].named();
  });
}

/// Measures frames, and with them distances, again around symbols that are no longer trusted.
void SymbolReview::measure_around_distrusted(const GridLinker& linker, Sightings& seen) {
  is_around_.assign(seen.size(), 0);
  for (const std::int32_t node : distrusted_)
    visit_measured_with(seen.nodes, node, [&](std::int32_t other) { is_around_[other] = 1; });
  const auto visit = [&](auto&& each) {
    for (std::size_t i = 0; i < seen.size(); ++i)
      if (is_around_[i] != 0) each(i);
  };
  visit([&](std::size_t i) { linker.measure_frame(seen.nodes, trusted_, i); });
  // Measure all frames first: a distance may use those around it.
  visit([&](std::size_t i) {
    if (is_reviewed(seen, i)) seen.misfits[i] = distance_from_letter(seen, i, seen.moments[i]);
  });
}

void SymbolReview::trust_whole_symbols(const GridLinker& linker, const Classifier& letters, Executor& executor,
                                       Sightings& seen) {
  trusted_.resize(seen.size());
  seen.misfits.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) trusted_[i] = is_reviewed(seen, i);
  decoded_ = trusted_;
  measure_distances(letters, executor, seen);
  distrusted_.clear();
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (trusted_[i] == 0) distrusted_.push_back(static_cast<std::int32_t>(i));
  measure_around_distrusted(linker, seen);
  distrusted_.clear();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (trusted_[i] == 0 || seen.misfits[i] <= options_.damaged_distance) continue;
    trusted_[i] = 0;
    distrusted_.push_back(static_cast<std::int32_t>(i));
  }
  measure_around_distrusted(linker, seen);
}

void SymbolReview::measure_light_changes(const Sightings& seen, Executor& executor) {
  light_changes_.resize(seen.size());
  executor.run_ranges(seen.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i)
      light_changes_[i] = {light_change(seen, i, kRight), light_change(seen, i, kDown)};
  });
}

/// The mean over the neighbours across the direction of the change. Small symbols blur to lower peaks, which is not due
/// to the light. Along that direction the change itself varies.
Eigen::Vector2f SymbolReview::light_change_around(const Sightings& seen, std::size_t node) const {
  const auto mean_with = [&](int axis, Direction one_side, Direction other_side) {
    float sum = light_changes_[node][axis], count = 1;
    for (const Direction d : {one_side, other_side}) {
      const std::int32_t other = neighbour(seen.nodes, static_cast<std::int32_t>(node), d);
      if (other < 0) continue;
      sum += light_changes_[other][axis], ++count;
      const std::int32_t next = neighbour(seen.nodes, other, d);
      if (next >= 0) sum += light_changes_[next][axis], ++count;
    }
    return sum / count;
  };
  return {mean_with(0, kUp, kDown), mean_with(1, kLeft, kRight)};
}

template <class T>
void SymbolReview::review_node(const ImageView<T>& frame, const Regions& regions, GreyMomentMeter& meter,
                               Sightings& seen, std::size_t node) const {
  GreyMoments& moments = seen.moments[node];
  float& distance = seen.misfits[node];
  const Region& region = regions.regions[seen.region[node]];
  bool has_steady_centre = false;
  const auto adopt_if_better = [&](const GreyMoments& again, float tolerance) {
    const float distance_again = distance_from_letter(seen, node, again);
    if (!(again.weight > 0 && distance_again < distance + tolerance)) return;
    moments = again, distance = distance_again, has_steady_centre = true;
  };
  const LatticeFrame& lattice_frame = seen.nodes[node].frame;
  const Eigen::Vector2f per_cell = light_change_around(seen, node);
  const float change = per_cell.cwiseAbs().maxCoeff();
  const auto shading = [&]() -> Eigen::Vector2f { return lattice_frame.inverse().transpose() * per_cell / pitch_px_; };
  if (change > options_.shading_min)
    adopt_if_better(meter.measure_levelled(frame, region, regions.runs_of(region), shading()), kLevellingTolerance);
  if (distance > options_.doubtful_distance) {
    const Eigen::Vector2f centroid(moments.x, moments.y);
    const Eigen::Vector2f own_centre = centroid - lattice_frame * prototype_of(seen.claims[node]).centroid_px;
    const Eigen::Vector2f centre = centre_from_neighbours(seen.nodes, node).value_or(own_centre);
    const float half_px = 0.25F * (size_px_ + pitch_px_);
    const GreyMoments again = meter.measure_cell(frame, centre, lattice_frame, half_px, shading());
    // Beside an edge the predicted place may be that of another symbol.
    const Eigen::Vector2f moved_px = Eigen::Vector2f(again.x, again.y) - centroid;
    if ((lattice_frame.inverse() * moved_px).norm() < options_.moved_max * pitch_px_) adopt_if_better(again, 0);
  }
  if (change > options_.uneven_light) {
    if (!has_steady_centre) moments = meter.measure(frame, region, regions.runs_of(region), SteadyCentre::kMeasured);
    const Prototype& prototype = prototype_of(seen.claims[node]);
    const Eigen::Vector2f from_steady = lattice_frame * (prototype.centroid_px - prototype.steady_centroid_px);
    moments.x = moments.steady_x + from_steady.x(), moments.y = moments.steady_y + from_steady.y();
  }
  const float at_boundary =
      seen.claims[node].grid_fit == GridFit::kTight ? options_.damaged_distance_on_grid : options_.damaged_distance;
  if (options_.rules.apply(DecodeRule::kSplit, distance > options_.damaged_distance_held)) {
    seen.claims[node].decide(DecodeRule::kSplit);
  } else if (options_.rules.apply(DecodeRule::kUnlikeLetter, distance > at_boundary && !is_inside(seen, node))) {
    seen.claims[node].decide(DecodeRule::kUnlikeLetter);
  }
}

void SymbolReview::review(const GreyView& frame, const Regions& regions, const GridLinker& linker, const Look& look,
                          std::span<GreyMomentMeter> meters, Executor& executor, Sightings& seen) {
  prototypes_ = &look.prototypes;
  trust_whole_symbols(linker, look.classifier, executor, seen);
  measure_light_changes(seen, executor);
  std::visit(
      [&](const auto& view) {
        executor.run_ranges(seen.size(), [&](std::size_t first, std::size_t last, int worker) {
          for (std::size_t i = first; i < last; ++i) {
            if (is_reviewed(seen, i)) review_node(view, regions, meters[worker], seen, i);
          }
        });
      },
      frame);
}

}  // namespace slsd
