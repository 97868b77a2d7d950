// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/surface_grid.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr int kStepsFromSeed = 4, kStepsFromNeighbour = 2;
/// Of the gain, for one camera px: how fast light and colour change on most of what is scanned.
constexpr float kGainSlopeSigma = 0.02F;
constexpr int kPartNodes = 64;
constexpr int kAttemptsMax = 4;
constexpr std::size_t kMisfitSamples = 60;

/// What makes a fit one: docs/dense.md has what each is for.
constexpr float kSupportMin = 0.5F;   // of the window's pixels agree
constexpr float kSeenMin = 0.7F;      // of them are in the frame and not saturated
constexpr float kResidualMax = 0.3F;  // of the gain
constexpr float kStepMaxPx = 0.8F;    // from the neighbour's plane: within the pull of the fit
constexpr float kSlopeMax = 0.5F;     // projector px for one camera px: steeper faces show too little of the pattern
constexpr float kSigmaMaxPx = 0.3F;
constexpr float kGainSlopeMax = 0.08F;  // of the gain, for one camera px
constexpr float kContrastMin = 4;       // of the gain over the noise of a pixel

/// Parts of sigma, as for symbols (docs/decoder.md).
constexpr float kLeastPx = 0.003F, kOfScatter = 1.2F;

AlignOptions steps(int count) {
  AlignOptions options;
  options.steps = count;
  options.gain_slope_sigma = kGainSlopeSigma;
  return options;
}

}  // namespace

SurfaceGrid::SurfaceGrid(const PatchGeometry& geometry, const GridOptions& options)
    : geometry_(&geometry), options_(options), first_(options.stride_px / 2) {
  const Lens& lens = geometry.camera.lens;
  columns_ = std::max(0, (lens.width_px - first_ + options.stride_px - 1) / options.stride_px);
  rows_ = std::max(0, (lens.height_px - first_ + options.stride_px - 1) / options.stride_px);
}

std::int32_t SurfaceGrid::node_at(const Eigen::Vector2f& camera_px) const {
  const auto stride = static_cast<float>(options_.stride_px), first = static_cast<float>(first_);
  const auto column = static_cast<int>(std::lround((camera_px.x() - first) / stride)),
             row = static_cast<int>(std::lround((camera_px.y() - first) / stride));
  return column < 0 || row < 0 || column >= columns_ || row >= rows_ ? -1 : row * columns_ + column;
}

bool SurfaceGrid::fit(const DenseFrame& frame, const PatternField& field, const Attempt& attempt, PatchAligner& aligner,
                      SurfaceNode& node) const {
  const SurfacePlane& start = attempt.start;
  const double depth_mm = 1 / static_cast<double>(start.inverse_depth);
  if (!(depth_mm > 0.9 * options_.depth_min_mm && depth_mm < 1.1 * options_.depth_max_mm)) return false;
  const int x = x_of(attempt.node % columns_), y = y_of(attempt.node / columns_), half = options_.window_px / 2;
  // Half a window tells little of a slope: the frame's rim takes its planes from farther in.
  const Lens& lens = geometry_->camera.lens;
  if (x < half || y < half || x + half >= lens.width_px || y + half >= lens.height_px) return false;
  const PatchMap map =
      geometry_->map_at({static_cast<float>(x), static_cast<float>(y)}, static_cast<double>(start.inverse_depth));
  const auto per_px = static_cast<float>(map.inverse_depth_per_px);
  PatchState state;
  state.slope_x = start.slope_x / per_px, state.slope_y = start.slope_y / per_px;
  state.across = attempt.across, state.gain = attempt.gain, state.gain_x = attempt.gain_x,
  state.gain_y = attempt.gain_y, state.offset = attempt.offset;
  const PatchWindow window{x - half, y - half, options_.window_px, options_.window_px};
  const PatchFit fit = std::visit(
      [&](const auto& pixels) {
        const float noise = frame.noise.at(static_cast<float>(pixels.at(x, y)));
        return aligner.align(pixels, frame.full, noise, field, map, window, state);
      },
      frame.pixels);
  if (!fit.solved || fit.support < kSupportMin) return false;
  if (fit.pixels < kSeenMin * static_cast<float>(options_.window_px * options_.window_px)) return false;
  const PatchState& found = fit.state;
  const float noise = frame.noise.at(found.offset + 0.5F * found.gain);
  if (fit.residual > kResidualMax * found.gain || found.gain < kContrastMin * noise) return false;
  if (std::abs(found.disparity) > kStepMaxPx) return false;
  if (std::hypot(found.gain_x, found.gain_y) > kGainSlopeMax * found.gain) return false;
  if (std::abs(found.slope_x) > kSlopeMax || std::abs(found.slope_y) > kSlopeMax) return false;
  node.noise_px = std::sqrt(fit.covariance(0, 0)) * fit.residual;
  node.slope_noise = std::sqrt(0.5F * (fit.covariance(1, 1) + fit.covariance(2, 2))) * fit.residual;
  node.sigma_px = std::sqrt(kLeastPx * kLeastPx + node.noise_px * node.noise_px +
                            kOfScatter * kOfScatter * fit.scatter * fit.scatter);
  if (!(node.sigma_px < kSigmaMaxPx)) return false;
  node.plane = {static_cast<float>(map.reference_inverse_depth + found.disparity * map.inverse_depth_per_px),
                found.slope_x * per_px, found.slope_y * per_px};
  node.per_px = per_px;
  node.across = found.across;
  node.gain = found.gain, node.gain_x = found.gain_x, node.gain_y = found.gain_y, node.offset = found.offset;
  node.support = fit.support;
  node.residual = fit.residual / found.gain;
  node.good = true;
  return true;
}

float SurfaceGrid::misfit(const DenseFrame& frame, const PatternField& field, std::span<const SurfaceSeed> seeds) {
  const std::size_t step = std::max<std::size_t>(1, seeds.size() / kMisfitSamples);
  if (begin_.empty()) begin_.emplace_back(steps(kStepsFromSeed));
  misfits_.clear();
  for (std::size_t i = step / 2; i < seeds.size(); i += step) {
    const std::int32_t index = node_at(seeds[i].camera_px);
    if (index < 0) continue;
    const float dx = static_cast<float>(x_of(index % columns_)) - seeds[i].camera_px.x(),
                dy = static_cast<float>(y_of(index / columns_)) - seeds[i].camera_px.y();
    SurfaceNode node;
    const SurfacePlane& plane = seeds[i].plane;
    const Attempt attempt{index, 0, {plane.at(dx, dy), plane.slope_x, plane.slope_y}, 0, 0, 0, 0, 0};
    misfits_.push_back(fit(frame, field, attempt, begin_[0], node) ? node.residual : 1);
  }
  if (misfits_.empty()) return 1;
  const auto middle = misfits_.begin() + static_cast<std::ptrdiff_t>(misfits_.size() / 2);
  std::nth_element(misfits_.begin(), middle, misfits_.end());
  return *middle;
}

void SurfaceGrid::offer(const Attempt& attempt) {
  std::int32_t& pending = pending_[attempt.node];
  if (pending >= 0) {
    if (attempt.cost < next_[pending].cost) next_[pending] = attempt;
    return;
  }
  if (nodes_[attempt.node].good || attempts_[attempt.node] >= kAttemptsMax) return;
  ++attempts_[attempt.node];
  pending = static_cast<std::int32_t>(next_.size());
  next_.push_back(attempt);
}

void SurfaceGrid::offer_neighbours(std::int32_t index) {
  const SurfaceNode& node = nodes_[index];
  const int column = index % columns_, row = index / columns_;
  const auto stride = static_cast<float>(options_.stride_px);
  const auto to = [&](int dx, int dy) {
    if (column + dx < 0 || row + dy < 0 || column + dx >= columns_ || row + dy >= rows_) return;
    const float x = stride * static_cast<float>(dx), y = stride * static_cast<float>(dy);
    const float gain = std::max(0.5F * node.gain, node.gain + node.gain_x * x + node.gain_y * y);
    offer({index + dy * columns_ + dx,
           node.sigma_px,
           {node.plane.at(x, y), node.plane.slope_x, node.plane.slope_y},
           node.across,
           gain,
           node.gain_x,
           node.gain_y,
           node.offset});
  };
  to(1, 0), to(-1, 0), to(0, 1), to(0, -1);
}

void SurfaceGrid::grow(const DenseFrame& frame, const PatternField& field, std::span<const SurfaceSeed> seeds,
                       Executor& executor) {
  const std::size_t count = static_cast<std::size_t>(columns_) * rows_;
  nodes_.assign(count, SurfaceNode{});
  pending_.assign(count, -1);
  attempts_.assign(count, 0);
  while (begin_.size() < static_cast<std::size_t>(executor.workers())) begin_.emplace_back(steps(kStepsFromSeed));
  while (continue_.size() < static_cast<std::size_t>(executor.workers()))
    continue_.emplace_back(steps(kStepsFromNeighbour));
  next_.clear();
  for (const SurfaceSeed& seed : seeds) {
    const std::int32_t index = node_at(seed.camera_px);
    if (index < 0) continue;
    const float dx = static_cast<float>(x_of(index % columns_)) - seed.camera_px.x(),
                dy = static_cast<float>(y_of(index / columns_)) - seed.camera_px.y();
    offer({index, 0, {seed.plane.at(dx, dy), seed.plane.slope_x, seed.plane.slope_y}, 0, 0, 0, 0, 0});
  }
  while (!next_.empty()) {
    front_.swap(next_);
    next_.clear();
    accepted_.assign(front_.size(), 0);
    const int parts = static_cast<int>((front_.size() + kPartNodes - 1) / kPartNodes);
    executor.run(parts, [&](int part, int worker) {
      const std::size_t end = std::min(front_.size(), static_cast<std::size_t>(part + 1) * kPartNodes);
      for (std::size_t i = static_cast<std::size_t>(part) * kPartNodes; i < end; ++i) {
        const Attempt& attempt = front_[i];
        PatchAligner& aligner = attempt.gain > 0 ? continue_[worker] : begin_[worker];
        accepted_[i] = fit(frame, field, attempt, aligner, nodes_[attempt.node]);
      }
    });
    for (const Attempt& attempt : front_) pending_[attempt.node] = -1;
    for (std::size_t i = 0; i < front_.size(); ++i) {
      if (accepted_[i]) offer_neighbours(front_[i].node);
    }
  }
}

namespace {

/// How far a node looks, in nodes.
constexpr int kFuseReach = 2;
constexpr float kFusePx = 0.015F;  // what the pattern's model leaves out, in each node
constexpr float kFuseSigmas = 3;
/// Of the scatter of the nodes around over what noise does: beyond it there is relief, and the mean is of fewer.
constexpr float kFuseExcess[kFuseReach] = {1.6F, 0.8F};
/// Parts of sigma: of what the nodes beside, continued, are off, and of what the bend moved.
constexpr float kOfDisagreement = 0.35F, kOfLift = 0.5F;

/// The nodes around a node, continued to it, and what their mean is.
struct NodeMean {
  double weights = 0, values = 0, slopes_x = 0, slopes_y = 0;
  float squares = 0, expected = 0;
  int count = 0;

  void add(double weight, float value, const SurfacePlane& plane, float off, float variance) {
    weights += weight, values += weight * static_cast<double>(value);
    slopes_x += weight * static_cast<double>(plane.slope_x), slopes_y += weight * static_cast<double>(plane.slope_y);
    squares += off * off, expected += variance, ++count;
  }
  /// Whether they are one surface, as far as noise tells.
  [[nodiscard]] bool holds(int reach) const {
    const int all = (2 * reach + 1) * (2 * reach + 1);
    const float excess = kFuseExcess[reach - 1];
    return 2 * count > all && squares < excess * excess * expected;
  }
  [[nodiscard]] SurfacePlane plane() const {
    return {static_cast<float>(values / weights), static_cast<float>(slopes_x / weights),
            static_cast<float>(slopes_y / weights)};
  }
};

/// How a slope changes along an axis around a node, by regression: projector px for one camera px squared; less where
/// noise could be the cause.
struct BendSums {
  float w = 0, x = 0, xx = 0, s = 0, xs = 0;

  void add(float weight, float at, float slope) {
    w += weight, x += weight * at, xx += weight * at * at, s += weight * slope, xs += weight * at * slope;
  }
  [[nodiscard]] float bend() const {
    const float spread = xx - x * x / w;
    if (!(spread > 0)) return 0;
    // Windows overlap: the slopes beside each other are wrong together.
    const float found = (xs - x * s / w) / spread, variance = kOverlap / spread;
    return found * std::max(0.F, 1 - variance / (found * found));
  }
  static constexpr float kOverlap = 3;
};

}  // namespace

// With a node's own slopes and its neighbour's, each by half, the neighbour's value is continued exactly over any
// surface of the second order.
void SurfaceGrid::fuse_node(int column, int row) {
  const std::size_t index = static_cast<std::size_t>(row) * columns_ + column;
  const SurfaceNode& own = own_[index];
  if (!own.good) return;
  SurfaceNode& node = nodes_[index];
  const auto stride = static_cast<float>(options_.stride_px);
  float beside = 0;
  int beside_count = 0;
  NodeMean means[kFuseReach];
  BendSums along_x, along_y;
  for (int dy = -kFuseReach; dy <= kFuseReach; ++dy) {
    for (int dx = -kFuseReach; dx <= kFuseReach; ++dx) {
      if (column + dx < 0 || row + dy < 0 || column + dx >= columns_ || row + dy >= rows_) continue;
      const SurfaceNode& other = own_[index + static_cast<std::ptrdiff_t>(dy) * columns_ + dx];
      if (!other.good) continue;
      const float x = stride * static_cast<float>(dx), y = stride * static_cast<float>(dy);
      const float there = other.plane.inverse_depth - 0.5F * ((other.plane.slope_x + own.plane.slope_x) * x +
                                                              (other.plane.slope_y + own.plane.slope_y) * y);
      const float off = (there - own.plane.inverse_depth) / own.per_px;
      const float of_slopes = 0.5F * (other.slope_noise + own.slope_noise);
      const float variance = other.noise_px * other.noise_px + of_slopes * of_slopes * (x * x + y * y);
      if (std::abs(dx) + std::abs(dy) == 1 && std::abs(off) < 1) {
        const float continued =
            (other.plane.inverse_depth - other.plane.slope_x * x - other.plane.slope_y * y - own.plane.inverse_depth) /
            own.per_px;
        beside += continued * continued, ++beside_count;
      }
      if (std::abs(off) < 1) {
        const float w = 1 / (other.slope_noise * other.slope_noise + 1e-8F);
        along_x.add(w, x, other.plane.slope_x / own.per_px);
        along_y.add(w, y, other.plane.slope_y / own.per_px);
      }
      const float expected = variance + own.noise_px * own.noise_px + kFusePx * kFusePx;
      if (off * off > kFuseSigmas * kFuseSigmas * expected) continue;
      const double weight = 1 / static_cast<double>(variance + kFusePx * kFusePx);
      for (int reach = std::max({1, std::abs(dx), std::abs(dy)}); reach <= kFuseReach; ++reach)
        means[reach - 1].add(weight, there, other.plane, off, expected);
    }
  }
  // A plane over a window lies beside what bends there by the bend times the mean of the squared distance from the
  // middle, by half.
  const auto side = static_cast<float>(options_.window_px);
  const float of_bend = side * side / 24, lift = of_bend * (along_x.bend() + along_y.bend());
  if (beside_count > 0) {
    node.sigma_px = std::sqrt(own.sigma_px * own.sigma_px + kOfLift * kOfLift * lift * lift +
                              kOfDisagreement * kOfDisagreement * beside / static_cast<float>(beside_count));
  }
  for (int reach = kFuseReach; reach > 0; --reach) {
    if (!means[reach - 1].holds(reach)) continue;
    node.plane = means[reach - 1].plane();
    break;
  }
  node.plane.inverse_depth -= lift * own.per_px;
}

void SurfaceGrid::fuse(Executor& executor) {
  own_ = nodes_;
  executor.run(rows_, [&](int row, int) {
    for (int column = 0; column < columns_; ++column) fuse_node(column, row);
  });
}

}  // namespace slsd
