// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/surface_grid.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/clones.hpp"
#include "core/geometry/robust.hpp"
#include "core/lanes.hpp"

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
/// Usual offset across the epipolar lines. A larger one suggests an equal error along the lines, which changes depth:
/// the excess adds to sigma.
constexpr float kUsualOffsetPx = 0.2F;
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

/// Steps until each fit has settled: from a neighbour's plane, one step is enough for most.
void SurfaceGrid::align(const DenseFrame& frame, const PatternField& field, Batch& batch, std::size_t count) const {
  for (int step = 0; step < kStepsMost && count > 0; ++step) {
    for (std::size_t i = 0; i < count; i += kEight) {
      align_eight(frame.pixels, frame.full, field, kAlign, options_.window_px,
                  std::span(batch.active).subspan(i, std::min<std::size_t>(kEight, count - i)));
    }
    const auto end = std::remove_if(
        batch.active.begin(), batch.active.begin() + static_cast<std::ptrdiff_t>(count),
        [&](const PatchTask* task) { return task->failed || (task->settled && std::abs(task->moved) < kSettledPx); });
    count = static_cast<std::size_t>(end - batch.active.begin());
    for (std::size_t i = 0; i < count; ++i) batch.active[i]->settled = true;
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
std::size_t SurfaceGrid::align_some(const DenseFrame& frame, const PatternField& field,
                                    std::span<const SurfaceSeed> seeds, std::size_t first, std::size_t step,
                                    Batch& batch) {
  std::size_t count = 0;
  for (std::size_t i = first; i < seeds.size() && count < kBatchNodes; i += step) {
    const std::int32_t index = node_at(seeds[i].camera_px);
    if (index < 0) continue;
    const float dx = static_cast<float>(x_of(index % columns_)) - seeds[i].camera_px.x(),
                dy = static_cast<float>(y_of(index / columns_)) - seeds[i].camera_px.y();
    const SurfacePlane& plane = seeds[i].plane;
    const Attempt attempt{index, 0, {plane.at(dx, dy), plane.slope_x, plane.slope_y}, 0, 0, 0, 0, 0};
    batch.tasks[count].settled = false;
    if (begin(frame, attempt, batch.tasks[count])) ++count;
  }
  for (std::size_t i = 0; i < count; ++i) batch.active[i] = &batch.tasks[i];
  align(frame, field, batch, count);
  return count;
}

BlurSeen SurfaceGrid::look_at_blur(const DenseFrame& frame, const PatternField& field,
                                   std::span<const SurfaceSeed> seeds) {
  const std::size_t step = (seeds.size() + kBatchNodes - 1) / kBatchNodes;
  if (batches_.empty()) batches_.resize(1);
  BlurSeen seen;
  seen.tried = align_some(frame, field, seeds, step / 2, step, batches_[0]);
  blur_meter_.clear();
  for (std::size_t i = 0; i < seen.tried; ++i) {
    SurfaceNode node;
    const PatchTask& task = batches_[0].tasks[i];
    if (!accept(task, node)) continue;
    ++seen.aligned;
    blur_meter_.add(frame.pixels, frame.full, field, kAlign,
                    {.patch = task, .window_px = options_.window_px, .square_half_px = kEverywherePx});
  }
  seen.blur_px = changed_blur_px(field.blur_sigma_px(), blur_meter_.change().value_or(0));
  seen.tone_change = blur_meter_.tone_change().value_or(0);
  return seen;
}

void SurfaceGrid::find_epipolar_offset(const DenseFrame& frame, const PatternField& field,
                                       std::span<const SurfaceSeed> seeds) {
  const Lens& lens = geometry_->camera.lens;
  if (batches_.empty()) batches_.resize(1);
  Batch& batch = batches_[0];
  epipolar_ = {};
  epipolar_.middle_px = 0.5F * Eigen::Vector2f(static_cast<float>(lens.width_px), static_cast<float>(lens.height_px));
  const EpipolarOffset none = epipolar_;
  const std::size_t step = std::max<std::size_t>(1, seeds.size() / kOffsetSeeds);
  // The aligner's prior holds the pattern near its line; a second round, from the first one's result, removes that
  // bias.
  for (int round = 0; round < 2; ++round) {
    offsets_.clear();
    for (std::size_t first = step / 2; first < seeds.size(); first += step * kBatchNodes) {
      const std::size_t count = align_some(frame, field, seeds, first, step, batch);
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

void SurfaceGrid::offer_neighbours(std::int32_t index) {
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
  to(1, 0), to(-1, 0), to(0, 1), to(0, -1);
}

void SurfaceGrid::clear() {
  const std::size_t count = static_cast<std::size_t>(columns_) * rows_;
  nodes_.assign(count, SurfaceNode{});
  pending_.assign(count, -1);
  attempts_.assign(count, 0);
}

void SurfaceGrid::offer_seeds(std::span<const SurfaceSeed> seeds) {
  for (const SurfaceSeed& seed : seeds) {
    const std::int32_t index = node_at(seed.camera_px);
    if (index < 0) continue;
    const float dx = static_cast<float>(x_of(index % columns_)) - seed.camera_px.x(),
                dy = static_cast<float>(y_of(index / columns_)) - seed.camera_px.y();
    offer({index, 0, {seed.plane.at(dx, dy), seed.plane.slope_x, seed.plane.slope_y}, 0, 0, 0, 0, 0});
  }
}

void SurfaceGrid::grow(const DenseFrame& frame, const PatternField& field, std::span<const SurfaceSeed> seeds,
                       Executor& executor) {
  next_.clear();
  offer_seeds(seeds);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i].good) offer_neighbours(static_cast<std::int32_t>(i));
  grow_fronts(frame, field, executor);
}

void SurfaceGrid::grow_on(const DenseFrame& frame, const PatternField& field, std::span<const SurfaceSeed> seeds,
                          Executor& executor) {
  for (std::uint8_t& attempts : attempts_)
    if (attempts != kClosed) attempts = 0;
  next_.clear();
  offer_seeds(seeds);
  grow_fronts(frame, field, executor);
}

void SurfaceGrid::grow_fronts(const DenseFrame& frame, const PatternField& field, Executor& executor) {
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
      for (std::size_t i = 0; i < in_part; ++i) {
        PatchTask& task = batch.tasks[i];
        task.settled = front_[first + i].gain > 0;
        task.failed = !begin(frame, front_[first + i], task);
        if (!task.failed) batch.active[active++] = &task;
      }
      align(frame, field, batch, active);
      for (std::size_t i = 0; i < in_part; ++i)
        accepted_[first + i] = accept(batch.tasks[i], nodes_[front_[first + i].node]);
    });
    for (const Attempt& attempt : front_) pending_[attempt.node] = -1;
    for (std::size_t i = 0; i < front_.size(); ++i) {
      if (accepted_[i]) offer_neighbours(front_[i].node);
    }
  }
}

namespace {

/// Reach of a node in fusing, in nodes.
constexpr int kFuseReach = 2;
constexpr float kFusePx = 0.015F;  // error of the pattern's model, in each node
constexpr float kFuseSigmas = 3;
/// Limits for taking the mean: the scatter of the surrounding nodes over their noise, and a node's move by the bend
/// over its noise. Beyond them there is relief, and the mean covers fewer nodes.
constexpr float kFuseExcess = 0.8F, kFlat = 0.7F;
/// Error that no mean reduces, px: focus and lenses differ slightly from the pattern's modelled blur.
constexpr float kFloorPx = 0.005F;
/// Factors of the neighbours' disagreement on a bend. A plane continued by a stride is off by half the bend times the
/// stride squared. A window's own plane is off by a 24th of the bend times the window squared. So the disagreement
/// measures the error.
constexpr float kOfBendLeft = 1.6F, kOfDisagreementLeast = 0.5F, kOfDisagreementMost = 4;
/// Share of the noise in the squared disagreement that is no relief.
constexpr float kOfNoise = 0.6F;
/// Factor of the variance of a mean over that of white noise: edges are uneven within the windows, and correcting bends
/// adds noise.
constexpr float kOfMean = 1.45F;
/// The share of the variance of noise that the mean of nodes leaves: windows of w px each, s px apart, weigh the pixels
/// along each axis by the sum of their boxes.
float left_of_variance(int reach, int window_px, int stride_px) {
  const int nodes = 2 * reach + 1, all = (nodes - 1) * stride_px + window_px;
  float squares = 0;
  for (int x = 0; x < all; ++x) {
    int windows = 0;
    for (int node = 0; node < nodes; ++node) windows += x >= node * stride_px && x < node * stride_px + window_px;
    squares += static_cast<float>(windows * windows);
  }
  const float along = squares / static_cast<float>(nodes * nodes * window_px);
  return std::min(1.F, kOfMean * along * along);
}

/// Factor for the shared errors of adjacent slopes, whose windows overlap: larger for the smaller reach.
constexpr float kOverlap[kFuseReach] = {9, 3};

/// Correction of a bend on waves of wave number k, which a regression over slopes underestimates. Over n slopes, a
/// stride s apart, the bend loses the share k^2 s^2 / 6 times r. Here r is the mean fourth power of the slopes' places
/// over their mean square (1 for three slopes, 3.4 for five). The window w of each slope takes another share, k^2 w^2 /
/// 40. So three slopes lack kBendBeyond + kWindowBeyond w^2 / s^2 times their difference from five. kBeyondMost limits
/// this factor: for windows much wider than strides, the series does not hold.
constexpr float kBendBeyond = 1 / 2.4F, kWindowBeyond = 6 / (2.4F * 40), kBeyondMost = 1.2F;

/// Inputs of fuse_lanes(): eight nodes of a row and their neighbours, in the order of Around.
struct Fusing {
  const float* around[7];
  std::ptrdiff_t row;  // distance between rows
  float stride, of_bend, of_disagreement;
  float beyond;       // factor of the bend correction
  const float* left;  // for each reach, see left_of_variance()
};
enum Around { kInverseDepth, kSlopeX, kSlopeY, kPxPer, kNoisePx, kSlopeNoise, kGood, kVariance };

/// Results of fuse_lanes(): planes in projector px relative to the nodes' own, the addition to sigma squared, and the
/// share of sigma squared that remains.
struct Fused {
  Lanes off, slope_x, slope_y, left, more;
};

/// The sums of a regression of slopes by place along an axis.
struct BendSums {
  Lanes w, x, xx, s, xs;

  inline __attribute__((always_inline)) void solve(Lanes& bend, Lanes& spread) const {
    spread = xx - x * x / w;
    bend = (xs - x * s / w) / spread;
  }
};

/// Reduces a bend by the part that noise may cause.
inline __attribute__((always_inline)) void take_noise_off(float overlap, const Lanes& spread, Lanes& bend) {
  const Lanes zero{}, sure = (zero + 1) - overlap / (spread * bend * bend);
  bend = ((spread > zero) & (sure > zero)) ? bend * sure : zero;
}

// The mean of a node's and its neighbour's slopes continues the neighbour's value exactly over any surface of the
// second order.
inline __attribute__((always_inline)) void fuse_lanes(const Fusing& in, Fused& fused) {
  const Lanes zero{}, one = zero + 1;
  Lanes own[7], beside = zero, beside_count = zero;
  for (int k = 0; k < 7; ++k) load(in.around[k], own[k]);
  struct Mean {
    Lanes weights, values, slopes_x, slopes_y, squares, expected, count;
  };
  Mean means[kFuseReach];
  for (Mean& mean : means) mean = {zero, zero, zero, zero, zero, zero, zero};
  BendSums along[2][kFuseReach];  // both axes
  for (auto& axis : along)
    for (BendSums& sums : axis) sums = {zero, zero, zero, zero, zero};
  const Lanes& px_per = own[kPxPer];
  const Lanes own_noise = own[kNoisePx] * own[kNoisePx] + kFusePx * kFusePx;
  for (int dy = -kFuseReach; dy <= kFuseReach; ++dy) {
    for (int dx = -kFuseReach; dx <= kFuseReach; ++dx) {
      Lanes other[7];
      for (int k = 0; k < 7; ++k) load(in.around[k] + dy * in.row + dx, other[k]);
      const float x = in.stride * static_cast<float>(dx), y = in.stride * static_cast<float>(dy);
      const Lanes apart = other[kInverseDepth] - own[kInverseDepth];
      const Lanes off =
          px_per * (apart - 0.5F * ((other[kSlopeX] + own[kSlopeX]) * x + (other[kSlopeY] + own[kSlopeY]) * y));
      const Lanes of_slopes = 0.5F * (other[kSlopeNoise] + own[kSlopeNoise]);
      const Lanes variance = other[kNoisePx] * other[kNoisePx] + of_slopes * of_slopes * (x * x + y * y);
      const Lanes near = off * off < one ? other[kGood] : zero;
      if (std::abs(dx) + std::abs(dy) == 1) {
        const Lanes continued = px_per * (apart - other[kSlopeX] * x - other[kSlopeY] * y);
        const Lanes by_noise = other[kNoisePx] * other[kNoisePx] + own[kNoisePx] * own[kNoisePx] +
                               other[kSlopeNoise] * other[kSlopeNoise] * (x * x + y * y);
        beside += near * (continued * continued - kOfNoise * by_noise), beside_count += near;
      }
      const Lanes w = near / (other[kSlopeNoise] * other[kSlopeNoise] + 1e-8F);
      const auto regress = [&](BendSums & sums, float at, const Lanes& slope) __attribute__((always_inline)) {
        sums.w += w, sums.x += w * at, sums.xx += w * (at * at), sums.s += w * slope, sums.xs += w * at * slope;
      };
      const Lanes steep_x = px_per * other[kSlopeX], steep_y = px_per * other[kSlopeY];
      const Lanes expected = variance + own_noise;
      const Lanes taken = off * off <= kFuseSigmas * kFuseSigmas * expected ? other[kGood] : zero;
      const Lanes weight = taken / (variance + kFusePx * kFusePx);
      for (int reach = std::max({1, std::abs(dx), std::abs(dy)}); reach <= kFuseReach; ++reach) {
        regress(along[0][reach - 1], x, steep_x), regress(along[1][reach - 1], y, steep_y);
        Mean& mean = means[reach - 1];
        mean.weights += weight, mean.values += weight * off;
        mean.slopes_x += weight * other[kSlopeX], mean.slopes_y += weight * other[kSlopeY];
        mean.squares += taken * off * off, mean.expected += taken * expected, mean.count += taken;
      }
    }
  }
  // A plane fitted to a window lies off a bent surface by half the bend times the mean squared distance from the
  // window's centre. Widely spaced slopes underestimate short waves more than close ones do; extrapolating from both
  // removes the loss. If noise hides that, use the bend of the wider regression, which covers long waves.
  Lanes lift = zero;
  for (const auto& axis : along) {
    Lanes near, wide, near_spread, wide_spread;
    axis[0].solve(near, near_spread), axis[1].solve(wide, wide_spread);
    near += in.beyond * (near - wide);
    take_noise_off(kOverlap[0] * (1 + in.beyond) * (1 + in.beyond), near_spread, near);
    take_noise_off(kOverlap[1], wide_spread, wide);
    lift += near * near > wide * wide ? near : wide;
  }
  lift *= in.of_bend;
  const Lanes any = beside_count > zero ? one : zero;
  beside = beside > zero ? beside : zero;
  fused.more = any * (lift * lift + in.of_disagreement * in.of_disagreement * beside / (beside_count + (one - any)));
  fused.left = one, fused.off = zero, fused.slope_x = own[kSlopeX], fused.slope_y = own[kSlopeY];
  for (int reach = 1; reach <= kFuseReach; ++reach) {
    const Mean& mean = means[reach - 1];
    const auto all = static_cast<float>((2 * reach + 1) * (2 * reach + 1));
    const IntLanes holds = (2 * mean.count > zero + all) & (mean.squares < kFuseExcess * kFuseExcess * mean.expected) &
                           (lift * lift < kFlat * kFlat * own_noise);
    const Lanes per_weight = one / (mean.weights + 1e-20F);
    fused.left = holds ? zero + in.left[reach - 1] : fused.left;
    fused.off = holds ? mean.values * per_weight : fused.off;
    fused.slope_x = holds ? mean.slopes_x * per_weight : fused.slope_x;
    fused.slope_y = holds ? mean.slopes_y * per_weight : fused.slope_y;
  }
  fused.off -= lift;
}

}  // namespace

void SurfaceGrid::fuse(Executor& executor) {
  // The data of all nodes, one quantity after the other, with a border of nodes that are not good.
  const std::size_t row = static_cast<std::size_t>(columns_) + 2 * kFuseReach + kLanes,
                    plane = row * (static_cast<std::size_t>(rows_) + 2 * kFuseReach);
  if (around_.size() != 8 * plane) around_.assign(8 * plane, 0);
  const auto place = [&](int at_row, int column, int what) {
    return around_.data() + what * plane + (static_cast<std::size_t>(at_row) + kFuseReach) * row + column + kFuseReach;
  };
  executor.run(rows_, [&](int at_row, int) {
    const SurfaceNode* nodes = nodes_.data() + static_cast<std::size_t>(at_row) * columns_;
    for (int column = 0; column < columns_; ++column) {
      const SurfaceNode& node = nodes[column];
      const float values[7] = {node.plane.inverse_depth,
                               node.plane.slope_x,
                               node.plane.slope_y,
                               1 / node.per_px,
                               node.noise_px,
                               node.slope_noise,
                               1};
      for (int k = 0; k < 7; ++k) *place(at_row, column, k) = node.good ? values[k] : 0;
      *place(at_row, column, kVariance) = 0;
    }
  });
  const auto side = static_cast<float>(options_.window_px), stride = static_cast<float>(options_.stride_px);
  std::array<float, kFuseReach> left;
  for (int reach = 1; reach <= kFuseReach; ++reach)
    left[reach - 1] = left_of_variance(reach, options_.window_px, options_.stride_px);
  executor.run(rows_, [&](int at_row, int) {
    Fusing fusing{
        {},
        static_cast<std::ptrdiff_t>(row),
        static_cast<float>(options_.stride_px),
        side * side / 24,
        std::clamp(kOfBendLeft * side * side / (12 * stride * stride), kOfDisagreementLeast, kOfDisagreementMost),
        std::min(kBeyondMost, kBendBeyond + kWindowBeyond * side * side / (stride * stride)),
        left.data()};
    SurfaceNode* nodes = nodes_.data() + static_cast<std::size_t>(at_row) * columns_;
    for (int column = 0; column < columns_; column += kLanes) {
      const int count = std::min(kLanes, columns_ - column);
      if (std::none_of(nodes + column, nodes + column + count, [](const SurfaceNode& node) { return node.good; }))
        continue;
      for (int k = 0; k < 7; ++k) fusing.around[k] = place(at_row, column, k);
      Fused fused;
      Cloned<fuse_lanes>::call(fusing, fused);
      for (int lane = 0; lane < count; ++lane) {
        SurfaceNode& node = nodes[column + lane];
        if (!node.good) continue;
        node.plane.inverse_depth += fused.off[lane] * node.per_px;
        node.plane.slope_x = fused.slope_x[lane], node.plane.slope_y = fused.slope_y[lane];
        *place(at_row, column + lane, kVariance) =
            fused.left[lane] * (node.sigma_px * node.sigma_px + fused.more[lane]);
      }
    }
  });
  // A node's own variance comes from few numbers and is itself uncertain: average it with those around it.
  executor.run(rows_, [&](int at_row, int) {
    SurfaceNode* nodes = nodes_.data() + static_cast<std::size_t>(at_row) * columns_;
    for (int column = 0; column < columns_; ++column) {
      if (!nodes[column].good) continue;
      float sum = 0, count = 0;
      for (int dy = -2; dy <= 2; ++dy) {
        const float *variance = place(at_row + dy, column, kVariance), *good = place(at_row + dy, column, kGood);
        for (int dx = -2; dx <= 2; ++dx) sum += variance[dx], count += good[dx];
      }
      const float off = epipolar_.at({static_cast<float>(x_of(column)), static_cast<float>(y_of(at_row))});
      const float unknown = std::max(0.F, std::abs(off) - kUsualOffsetPx);
      nodes[column].sigma_px = std::sqrt(sum / count + unknown * unknown + kFloorPx * kFloorPx);
    }
  });
}

}  // namespace slsd
