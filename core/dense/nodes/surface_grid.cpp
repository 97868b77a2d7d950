// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/nodes/surface_grid.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

/// A start that the last step moved by less has settled: the rest is less than a hundredth of that.
constexpr float kSettledPx = 0.1F;
constexpr int kStepsMost = 4;

/// Conditions of a good fit: docs/notes/2026-11-dense.md has the reason for each.
constexpr float kSupportMin = 0.6F;   // share of the window's pixels that agree
constexpr float kResidualMax = 0.3F;  // share of the gain
constexpr float kStepMaxPx = 0.8F;    // from the neighbour's plane: within the range in which the fit converges
constexpr float kSlopeMax = 0.5F;     // projector px for one camera px: steeper faces show too little of the pattern
constexpr float kSigmaMaxPx = 0.3F;
constexpr float kGainSlopeMax = 0.08F;  // share of the gain, for one camera px

/// Ratio of the fit's standard deviation under normal noise to that from the weighted residual: outlying pixels count
/// less, so the residual is smaller than the noise (Huber 1981, for the weights of AlignOptions::outlier_sigmas = 4).
constexpr float kOfResidual = 1.07F;
/// Parts of sigma, as for symbols (docs/notes/2026-11-decoder.md).
constexpr float kLeastPx = 0.003F, kOfScatter = 0.8F;

/// Numbers of seeds for the epipolar offset: at most, at least for its middle, and at least for its slopes.
constexpr std::size_t kOffsetSeeds = 256, kOffsetSeedsLeast = 8, kOffsetSlopeSeeds = 48;
constexpr float kOffsetPx = 0.05F;  // scatter of a seed's offset from relief and noise
/// Half side of a square that contains any pattern.
constexpr float kEverywherePx = 1e6F;
constexpr float kOffsetSlope = 0.001F;  // for one camera px: after a stronger knock, symbols would not decode

}  // namespace

SurfaceGrid::SurfaceGrid(const PatchGeometry& geometry, const GridOptions& options)
    : geometry_(&geometry), options_(options), first_(options.stride_px / 2) {
  const Lens& lens = geometry.camera.lens;
  columns_ = std::max(0, (lens.width_px - first_ + options.stride_px - 1) / options.stride_px);
  rows_ = std::max(0, (lens.height_px - first_ + options.stride_px - 1) / options.stride_px);
  turned_.reserve(static_cast<std::size_t>(columns_) * rows_);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      turned_.push_back(
          turned_by(geometry.rays.ray(Eigen::Vector2d(x_of(column), y_of(row))), geometry.camera.projector_from_camera)
              .cast<float>());
}

std::size_t SurfaceGrid::bytes() const {
  const auto of = [](const auto& held) { return held.capacity() * sizeof held[0]; };
  return of(turned_) + of(nodes_) + of(around_) + of(front_) + of(next_) + of(accepted_) + of(pending_) +
         of(attempts_) + of(batches_) + of(offsets_);
}

std::int32_t SurfaceGrid::node_at(const Eigen::Vector2f& camera_px) const {
  const auto stride = static_cast<float>(options_.stride_px), first = static_cast<float>(first_);
  const auto column = static_cast<int>(std::lround((camera_px.x() - first) / stride)),
             row = static_cast<int>(std::lround((camera_px.y() - first) / stride));
  return column < 0 || row < 0 || column >= columns_ || row >= rows_ ? -1 : row * columns_ + column;
}

/// Sets up the task; false if nothing can be fitted.
bool SurfaceGrid::begin(const DenseFrame& frame, const Attempt& attempt, PatchTask& task) const {
  const SurfacePlane& start = attempt.start;
  const double inverse_depth = static_cast<double>(start.inverse_depth);
  if (!(0.9 * options_.depth_min_mm * inverse_depth < 1 && 1.1 * options_.depth_max_mm * inverse_depth > 1))
    return false;
  task.x = x_of(attempt.node % columns_), task.y = y_of(attempt.node / columns_);
  const int half = options_.window_px / 2;
  // Half a window determines a slope poorly: the frame's border takes its planes from farther inside.
  const Lens& lens = geometry_->camera.lens;
  if (task.x < half || task.y < half || task.x + half >= lens.width_px || task.y + half >= lens.height_px) return false;
  task.map = map_at(attempt.node % columns_, attempt.node / columns_, inverse_depth);
  const float px = static_cast<float>(1 / task.map.inverse_depth_per_px);
  task.state = {};
  task.state.slope_x = start.slope_x * px, task.state.slope_y = start.slope_y * px;
  task.state.across = attempt.across, task.state.gain = attempt.gain, task.state.gain_x = attempt.gain_x,
  task.state.gain_y = attempt.gain_y, task.state.offset = attempt.offset;
  task.noise = std::visit(
      [&](const auto& pixels) { return frame.noise.at(static_cast<float>(pixels.at(task.x, task.y))); }, frame.pixels);
  return true;
}

/// Steps until each fit of some active tasks has settled: from a neighbour's plane, one step is enough for most.
void SurfaceGrid::align(const DenseFrame& frame, const PatternField& field, Batch& batch, std::size_t first,
                        std::size_t count) const {
  const auto active = std::span(batch.active).subspan(first);
  for (int step = 0; step < kStepsMost && count > 0; ++step) {
    const auto eight = [&](std::size_t from) {
      return active.subspan(from, std::min<std::size_t>(kEight, count - from));
    };
    for (std::size_t i = 0; i < count; i += kEight) {
      if (step == 0 && i + kEight < count) fetch_windows(field, options_.window_px, eight(i + kEight));
      align_eight(frame.pixels, frame.full, field, kAlign, options_.window_px, eight(i));
    }
    const auto end = std::remove_if(
        active.begin(), active.begin() + static_cast<std::ptrdiff_t>(count),
        [&](const PatchTask* task) { return task->failed || (task->settled && std::abs(task->moved) < kSettledPx); });
    count = static_cast<std::size_t>(end - active.begin());
    for (std::size_t i = 0; i < count; ++i) active[i]->settled = true;
  }
}

/// Aligns some of the active tasks, each with the field of its blur.
void SurfaceGrid::align_by_blur(const DenseFrame& frame, const BlurredPattern& pattern, Batch& batch, std::size_t first,
                                std::size_t count) const {
  const std::size_t last = first + count;
  const auto blur_of = [&](const PatchTask* task) {
    return batch.blurs[static_cast<std::size_t>(task - batch.tasks.data())];
  };
  if (pattern.levels() > 1) {
    std::array<PatchTask*, kBatchNodes> unsorted;
    std::copy_n(batch.active.begin() + static_cast<std::ptrdiff_t>(first), count, unsorted.begin());
    std::size_t sorted = first;
    for (int level = 0; level < pattern.levels(); ++level)
      for (std::size_t i = 0; i < count; ++i)
        if (blur_of(unsorted[i]) == level) batch.active[sorted++] = unsorted[i];
  }
  for (std::size_t end = first; first < last; first = end) {
    const std::uint8_t blur = blur_of(batch.active[first]);
    while (end < last && blur_of(batch.active[end]) == blur) ++end;
    align(frame, pattern.field(blur), batch, first, end - first);
  }
}

bool SurfaceGrid::accept(const PatchTask& task, SurfaceNode& node) const {
  if (task.failed || task.support < kSupportMin) return false;
  const PatchState& found = task.state;
  if (task.residual > kResidualMax * found.gain) return false;
  if (std::abs(found.disparity) > kStepMaxPx) return false;
  const auto squares = [](float x, float y) { return x * x + y * y; };
  if (squares(found.gain_x, found.gain_y) > kGainSlopeMax * kGainSlopeMax * found.gain * found.gain) return false;
  if (std::abs(found.slope_x) > kSlopeMax || std::abs(found.slope_y) > kSlopeMax) return false;
  node.noise_px = kOfResidual * std::sqrt(task.variance) * task.residual;
  node.slope_noise = kOfResidual * std::sqrt(task.slope_variance) * task.residual;
  node.sigma_px = std::sqrt(kLeastPx * kLeastPx + node.noise_px * node.noise_px +
                            kOfScatter * kOfScatter * task.scatter * task.scatter);
  if (!(node.sigma_px < kSigmaMaxPx)) return false;
  const auto per_px = static_cast<float>(task.map.inverse_depth_per_px);
  node.plane = {static_cast<float>(task.map.reference_inverse_depth +
                                   static_cast<double>(found.disparity) * task.map.inverse_depth_per_px),
                found.slope_x * per_px, found.slope_y * per_px};
  node.per_px = per_px;
  node.across = found.across;
  node.gain = found.gain, node.gain_x = found.gain_x, node.gain_y = found.gain_y, node.offset = found.offset;
  node.support = task.support;
  node.residual = task.residual / found.gain;
  node.good = true;
  return true;
}

/// Aligns every nth seed, at most a batch of them. @return number of tasks that began, at the batch's front
std::size_t SurfaceGrid::align_some(const DenseFrame& frame, const BlurredPattern& pattern,
                                    std::span<const SurfaceSeed> seeds, std::size_t first, std::size_t step,
                                    Batch& batch, Executor& executor) {
  std::size_t count = 0;
  for (std::size_t i = first; i < seeds.size() && count < kBatchNodes; i += step) {
    const std::int32_t index = node_at(seeds[i].camera_px);
    if (index < 0) continue;
    const float dx = static_cast<float>(x_of(index % columns_)) - seeds[i].camera_px.x(),
                dy = static_cast<float>(y_of(index / columns_)) - seeds[i].camera_px.y();
    const SurfacePlane& plane = seeds[i].plane;
    const Attempt attempt{index, 0, {plane.at(dx, dy), plane.slope_x, plane.slope_y}, 0, 0, 0, 0, 0};
    PatchTask& task = batch.tasks[count];
    task.settled = false;
    if (!begin(frame, attempt, task)) continue;
    batch.blurs[count++] = static_cast<std::uint8_t>(pattern.level_at(task.map.middle_px, attempt.start.inverse_depth));
  }
  for (std::size_t i = 0; i < count; ++i) batch.active[i] = &batch.tasks[i];
  executor.run_ranges(
      count, [&](std::size_t from, std::size_t to, int) { align_by_blur(frame, pattern, batch, from, to - from); },
      kAlignedAtOnce);
  return count;
}

BlurSeen SurfaceGrid::look_at_blur(const DenseFrame& frame, const BlurredPattern& pattern,
                                   std::span<const SurfaceSeed> seeds, Executor& executor) {
  const std::size_t step = (seeds.size() + kBatchNodes - 1) / kBatchNodes;
  if (batches_.empty()) batches_.resize(1);
  BlurSeen seen;
  Batch& batch = batches_[0];
  seen.tried = align_some(frame, pattern, seeds, step / 2, step, batch, executor);
  struct Looked {
    SurfaceNode node;
    std::optional<PatchBlur> blur;
  };
  std::array<Looked, kBatchNodes> looked;
  executor.run_ranges(
      seen.tried,
      [&](std::size_t first, std::size_t last, int) {
        for (std::size_t i = first; i < last; ++i) {
          if (!accept(batch.tasks[i], looked[i].node)) continue;
          looked[i].blur = blur_of_patch(
              frame.pixels, frame.full, pattern.field(batch.blurs[i]), kAlign,
              {.patch = batch.tasks[i], .window_px = options_.window_px, .square_half_px = kEverywherePx});
        }
      },
      kAlignedAtOnce);
  blur_meter_.clear(), blur_samples_.clear();
  for (std::size_t i = 0; i < seen.tried; ++i) {
    const auto& [node, blur] = looked[i];
    seen.aligned += node.good ? 1 : 0;
    if (!blur) continue;
    blur_meter_.add(*blur);
    blur_samples_.push_back({batch.tasks[i].map.middle_px, node.plane.inverse_depth, blur->variance});
  }
  seen.blur_px = changed_blur_px(pattern.usual().blur_sigma_px(), blur_meter_.change().value_or(0));
  seen.tone_change = blur_meter_.tone_change().value_or(0);
  return seen;
}

void SurfaceGrid::find_epipolar_offset(const DenseFrame& frame, const BlurredPattern& pattern,
                                       std::span<const SurfaceSeed> seeds, bool again, Executor& executor) {
  const Lens& lens = geometry_->camera.lens;
  if (batches_.empty()) batches_.resize(1);
  Batch& batch = batches_[0];
  EpipolarOffset none;
  none.middle_px = 0.5F * Eigen::Vector2f(static_cast<float>(lens.width_px), static_cast<float>(lens.height_px));
  if (!again) epipolar_ = none;
  const std::size_t step = std::max<std::size_t>(1, seeds.size() / kOffsetSeeds);
  // The aligner's prior holds the pattern near its line; a second round, from the first one's result, removes that
  // bias.
  for (int round = again ? 1 : 0; round < 2; ++round) {
    offsets_.clear();
    for (std::size_t first = step / 2; first < seeds.size(); first += step * kBatchNodes) {
      const std::size_t count = align_some(frame, pattern, seeds, first, step, batch, executor);
      for (std::size_t i = 0; i < count; ++i) {
        SurfaceNode node;
        const PatchTask& task = batch.tasks[i];
        if (!accept(task, node)) continue;
        const Eigen::Vector2f from_middle = task.map.middle_px - epipolar_.middle_px;
        offsets_.emplace_back(from_middle.x(), from_middle.y(), epipolar_.at(task.map.middle_px) + node.across);
      }
    }
    if (offsets_.size() < kOffsetSeedsLeast) return void(epipolar_ = none);
    epipolar_.middle = median_in_place(offsets_, [](const Eigen::Vector3f& offset) { return offset.z(); });
    epipolar_.slope_x = epipolar_.slope_y = 0;
    if (offsets_.size() < kOffsetSlopeSeeds) continue;
    // Fit a plane through the offsets, with small weights for outliers and a prior of small slopes.
    for (int pass = 0; pass < 4; ++pass) {
      Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
      Eigen::Vector3f right = Eigen::Vector3f::Zero();
      for (const Eigen::Vector3f& seen : offsets_) {
        const Eigen::Vector3f row(1, seen.x(), seen.y());
        const float off = seen.z() - row.dot(Eigen::Vector3f(epipolar_.middle, epipolar_.slope_x, epipolar_.slope_y));
        const float weight = 1 / (1 + off * off / (kOffsetPx * kOffsetPx));
        normal += weight * row * row.transpose(), right += weight * row * seen.z();
      }
      normal(1, 1) += kOffsetPx * kOffsetPx / (kOffsetSlope * kOffsetSlope);
      normal(2, 2) += kOffsetPx * kOffsetPx / (kOffsetSlope * kOffsetSlope);
      const Eigen::Vector3f plane = normal.ldlt().solve(right);
      if (!plane.allFinite()) break;
      epipolar_.middle = plane.x(), epipolar_.slope_x = plane.y(), epipolar_.slope_y = plane.z();
    }
  }
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

void SurfaceGrid::offer_neighbours(std::int32_t index, int step) {
  const SurfaceNode& node = nodes_[index];
  const int column = index % columns_, row = index / columns_;
  const auto stride = static_cast<float>(options_.stride_px);
  const auto to = [&](int dx, int dy) {
    if (column + dx < 0 || row + dy < 0 || column + dx >= columns_ || row + dy >= rows_) return;
    if (nodes_[index + dy * columns_ + dx].good) return;
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
  to(step, 0), to(-step, 0), to(0, step), to(0, -step);
}

void SurfaceGrid::clear() {
  const std::size_t count = static_cast<std::size_t>(columns_) * rows_;
  nodes_.assign(count, SurfaceNode{});
  pending_.assign(count, -1);
  attempts_.assign(count, 0);
}

void SurfaceGrid::offer_seed(std::int32_t index, const SurfaceSeed& seed) {
  if (index < 0) return;
  const float dx = static_cast<float>(x_of(index % columns_)) - seed.camera_px.x(),
              dy = static_cast<float>(y_of(index / columns_)) - seed.camera_px.y();
  offer({index, 0, {seed.plane.at(dx, dy), seed.plane.slope_x, seed.plane.slope_y}, 0, 0, 0, 0, 0});
}

void SurfaceGrid::forget_attempts() {
  for (std::uint8_t& attempts : attempts_)
    if (attempts != kClosed) attempts = 0;
}

void SurfaceGrid::grow_coarse(const DenseFrame& frame, const BlurredPattern& pattern,
                              std::span<const SurfaceSeed> seeds, const CoarseLattice& lattice, Executor& executor) {
  next_.clear();
  const auto nearest = [&](int node, int count) {
    const int coarse = static_cast<int>(std::lround(static_cast<double>(node - lattice.first) / lattice.step));
    return lattice.of(std::clamp(coarse, 0, count - 1));
  };
  for (const SurfaceSeed& seed : seeds) {
    const std::int32_t index = node_at(seed.camera_px);
    if (index < 0) continue;
    offer_seed(nearest(index / columns_, lattice.rows) * columns_ + nearest(index % columns_, lattice.columns), seed);
  }
  for (int row = 0; row < lattice.rows; ++row)
    for (int column = 0; column < lattice.columns; ++column)
      if (const std::int32_t index = lattice.of(row) * columns_ + lattice.of(column); nodes_[index].good)
        offer_neighbours(index, lattice.step);
  grow_fronts(frame, pattern, lattice.step, executor);
  forget_attempts();
}

void SurfaceGrid::grow(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
                       Executor& executor) {
  next_.clear();
  for (const SurfaceSeed& seed : seeds) offer_seed(node_at(seed.camera_px), seed);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i].good) offer_neighbours(static_cast<std::int32_t>(i), 1);
  grow_fronts(frame, pattern, 1, executor);
}

void SurfaceGrid::grow_on(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
                          Executor& executor) {
  forget_attempts();
  next_.clear();
  for (const SurfaceSeed& seed : seeds) offer_seed(node_at(seed.camera_px), seed);
  grow_fronts(frame, pattern, 1, executor);
}

BlockPlaces SurfaceGrid::places_of(int row) const {
  const Eigen::Vector3d& translation = geometry_->camera.projector_from_camera.translation;
  return {x_of(0),
          y_of(row),
          turned_[static_cast<std::size_t>(row) * columns_].data(),
          {translation.x(), translation.y(), translation.z()},
          geometry_->projector,
          epipolar_};
}

void SurfaceGrid::grow_fronts(const DenseFrame& frame, const BlurredPattern& pattern, int step, Executor& executor) {
  if (batches_.size() < static_cast<std::size_t>(executor.workers())) batches_.resize(executor.workers());
  while (!next_.empty()) {
    front_.swap(next_);
    next_.clear();
    accepted_.assign(front_.size(), 0);
    const auto parts = static_cast<int>((front_.size() + kBatchNodes - 1) / kBatchNodes);
    executor.run(parts, [&](int part, int worker) {
      const std::size_t first = static_cast<std::size_t>(part) * kBatchNodes,
                        in_part = std::min(kBatchNodes, front_.size() - first);
      Batch& batch = batches_[worker];
      std::size_t active = 0;
      // A front's nodes lie far apart in memory.
      for (std::size_t i = 0; i < in_part; ++i) {
        const std::int32_t node = front_[first + i].node;
        __builtin_prefetch(&turned_[node]), __builtin_prefetch(&nodes_[node], 1);
      }
      for (std::size_t i = 0; i < in_part; ++i) {
        PatchTask& task = batch.tasks[i];
        task.settled = front_[first + i].gain > 0;
        task.failed = !begin(frame, front_[first + i], task);
        if (task.failed) continue;
        batch.blurs[i] =
            static_cast<std::uint8_t>(pattern.level_at(task.map.middle_px, front_[first + i].start.inverse_depth));
        batch.active[active++] = &task;
      }
      align_by_blur(frame, pattern, batch, 0, active);
      for (std::size_t i = 0; i < in_part; ++i) {
        SurfaceNode& node = nodes_[front_[first + i].node];
        accepted_[first + i] = accept(batch.tasks[i], node);
        if (accepted_[first + i]) node.blur = batch.blurs[i];
      }
    });
    for (const Attempt& attempt : front_) pending_[attempt.node] = -1;
    constexpr std::size_t kAhead = 8;
    const auto last = static_cast<std::int32_t>(nodes_.size()) - 1;
    const auto fetch_around = [&](std::int32_t node) {
      for (const std::int32_t by : {step, -step, step * columns_, -step * columns_}) {
        const std::int32_t other = std::clamp(node + by, 0, last);
        __builtin_prefetch(&nodes_[other]), __builtin_prefetch(&pending_[other], 1);
      }
    };
    for (std::size_t i = 0; i < front_.size(); ++i) {
      if (i + kAhead < front_.size() && accepted_[i + kAhead]) fetch_around(front_[i + kAhead].node);
      if (accepted_[i]) offer_neighbours(front_[i].node, step);
    }
  }
}

}  // namespace slsd
