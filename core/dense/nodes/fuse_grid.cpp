// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/clones.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Reach of a node in fusing, in nodes.
constexpr int kFuseReach = SurfaceGrid::kFuseReach;
constexpr float kFusePx = 0.015F;  // error of the pattern's model, in each node
constexpr float kFuseSigmas = 3;
/// Limits for taking the mean: the scatter of the surrounding nodes over their noise, and a node's move by the bend
/// over its noise. Beyond them there is relief, and the mean covers fewer nodes.
constexpr float kFuseExcess = 0.8F, kFlat = 0.7F;
/// Error that no mean reduces, px: focus and lenses differ slightly from the pattern's modelled blur.
constexpr float kFloorPx = 0.005F;
/// Usual offset across the epipolar lines. A larger one suggests an equal error along the lines, which changes depth:
/// the excess adds to sigma.
constexpr float kUsualOffsetPx = 0.2F;
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

/// Numbers of each node: kInformation is that of a slope, kVariance the result.
enum Around {
  kInverseDepth,
  kSlopeX,
  kSlopeY,
  kPxPer,
  kNoiseSquared,
  kSlopeNoise,
  kInformation,
  kGood,
  kInputs,
  kVariance = kInputs,
  kNumbers
};

/// Inputs of fuse_lanes(): eight nodes of a row and their neighbours, in the order of Around.
struct Fusing {
  const float* around[kInputs];
  std::ptrdiff_t row;  // distance between rows
  float stride, of_bend, of_disagreement;
  float beyond;       // factor of the bend correction
  const float* left;  // for each reach, see left_of_variance()
};

/// Results of fuse_lanes(): planes in projector px relative to the nodes' own, the addition to sigma squared, and the
/// share of sigma squared that remains.
struct Fused {
  Lanes off, slope_x, slope_y, left, more;
};

/// Sums over nodes: of their mean, and of the regressions of slopes by place along both axes.
struct FuseSums {
  Lanes weights, values, slopes_x, slopes_y, squares, expected, count;
  Lanes w, x[2], xx[2], s[2], xs[2];

  inline __attribute__((always_inline)) void add_slopes(float at_x, float at_y, const Lanes& weight,
                                                        const Lanes& slope_x, const Lanes& slope_y) {
    const Lanes of_x = weight * slope_x, of_y = weight * slope_y;
    w += weight;
    x[0] += weight * at_x, xx[0] += weight * (at_x * at_x), s[0] += of_x, xs[0] += of_x * at_x;
    x[1] += weight * at_y, xx[1] += weight * (at_y * at_y), s[1] += of_y, xs[1] += of_y * at_y;
  }
  inline __attribute__((always_inline)) void add(const FuseSums& more) {
    weights += more.weights, values += more.values, slopes_x += more.slopes_x, slopes_y += more.slopes_y;
    squares += more.squares, expected += more.expected, count += more.count, w += more.w;
    for (int axis = 0; axis < 2; ++axis) {
      x[axis] += more.x[axis], xx[axis] += more.xx[axis];
      s[axis] += more.s[axis], xs[axis] += more.xs[axis];
    }
  }
  inline __attribute__((always_inline)) void bend(int axis, Lanes& bend, Lanes& spread) const {
    spread = xx[axis] - x[axis] * x[axis] / w;
    bend = (xs[axis] - x[axis] * s[axis] / w) / spread;
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
  Lanes own[kInputs], beside = zero, beside_count = zero;
  for (int k = 0; k < kInputs; ++k) load(in.around[k], own[k]);
  FuseSums rings[kFuseReach]{};  // first the nodes within a reach of one, then those around them
  const Lanes& px_per = own[kPxPer];
  const Lanes own_noise = own[kNoiseSquared] + kFusePx * kFusePx;
  for (int dy = -kFuseReach; dy <= kFuseReach; ++dy) {
    for (int dx = -kFuseReach; dx <= kFuseReach; ++dx) {
      Lanes other[kInputs];
      for (int k = 0; k < kInputs; ++k) load(in.around[k] + dy * in.row + dx, other[k]);
      const float x = in.stride * static_cast<float>(dx), y = in.stride * static_cast<float>(dy);
      const Lanes apart = other[kInverseDepth] - own[kInverseDepth];
      const Lanes off =
          px_per * (apart - 0.5F * ((other[kSlopeX] + own[kSlopeX]) * x + (other[kSlopeY] + own[kSlopeY]) * y));
      const Lanes of_slopes = 0.5F * (other[kSlopeNoise] + own[kSlopeNoise]), squared = off * off;
      const Lanes variance = other[kNoiseSquared] + of_slopes * of_slopes * (x * x + y * y);
      const Lanes near = squared < one ? other[kGood] : zero;
      if (std::abs(dx) + std::abs(dy) == 1) {
        const Lanes continued = px_per * (apart - other[kSlopeX] * x - other[kSlopeY] * y);
        const Lanes by_noise =
            other[kNoiseSquared] + own[kNoiseSquared] + other[kSlopeNoise] * other[kSlopeNoise] * (x * x + y * y);
        beside += near * (continued * continued - kOfNoise * by_noise), beside_count += near;
      }
      const Lanes expected = variance + own_noise;
      const Lanes taken = squared <= kFuseSigmas * kFuseSigmas * expected ? other[kGood] : zero;
      FuseSums& ring = rings[std::max({1, std::abs(dx), std::abs(dy)}) - 1];
      ring.add_slopes(x, y, near * other[kInformation], px_per * other[kSlopeX], px_per * other[kSlopeY]);
      const Lanes weight = taken / (variance + kFusePx * kFusePx);
      ring.weights += weight, ring.values += weight * off;
      ring.slopes_x += weight * other[kSlopeX], ring.slopes_y += weight * other[kSlopeY];
      ring.squares += taken * squared, ring.expected += taken * expected, ring.count += taken;
    }
  }
  for (int reach = 1; reach < kFuseReach; ++reach) rings[reach].add(rings[reach - 1]);
  // A plane fitted to a window lies off a bent surface by half the bend times the mean squared distance from the
  // window's centre. Widely spaced slopes underestimate short waves more than close ones do; extrapolating from both
  // removes the loss. If noise hides that, use the bend of the wider regression, which covers long waves.
  Lanes lift = zero;
  for (int axis = 0; axis < 2; ++axis) {
    Lanes near, wide, near_spread, wide_spread;
    rings[0].bend(axis, near, near_spread), rings[1].bend(axis, wide, wide_spread);
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
    const FuseSums& mean = rings[reach - 1];
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

/// Sums a square of nodes around each of eight.
inline __attribute__((always_inline)) void sum_squares(const float* middle, std::ptrdiff_t row, float* to) {
  Lanes sum{};
  for (int dy = -kFuseReach; dy <= kFuseReach; ++dy) {
    for (int dx = -kFuseReach; dx <= kFuseReach; ++dx) {
      Lanes more;
      load(middle + dy * row + dx, more);
      sum += more;
    }
  }
  std::memcpy(to, &sum, sizeof sum);
}

/// Sizes of the data of all nodes: one quantity after the other, with a border of nodes that are not good.
struct Planes {
  std::size_t row, plane;
  Planes(int columns, int rows)
      : row(static_cast<std::size_t>(columns) + 2 * kFuseReach + kLanes),
        plane(row * (static_cast<std::size_t>(rows) + 2 * kFuseReach)) {}
  [[nodiscard]] std::size_t place(int at_row, int column, int what) const {
    return what * plane + (static_cast<std::size_t>(at_row + kFuseReach)) * row + column + kFuseReach;
  }
};

}  // namespace

const float* SurfaceGrid::goods(int row) const {
  return around_.data() + Planes(columns_, rows_).place(row, 0, kGood);
}

void SurfaceGrid::fuse(Executor& executor) {
  const Planes planes(columns_, rows_);
  const std::size_t row = planes.row, plane = planes.plane;
  if (around_.size() != kNumbers * plane) around_.assign(kNumbers * plane, 0);
  const auto place = [&](int at_row, int column, int what) {
    return around_.data() + planes.place(at_row, column, what);
  };
  executor.run(rows_, [&](int at_row, int) {
    const SurfaceNode* nodes = nodes_.data() + static_cast<std::size_t>(at_row) * columns_;
    float* const first = place(at_row, 0, 0);
    for (int column = 0; column < columns_; ++column) {
      const SurfaceNode& node = nodes[column];
      const float values[kNumbers] = {node.plane.inverse_depth,
                                      node.plane.slope_x,
                                      node.plane.slope_y,
                                      1 / node.per_px,
                                      node.noise_px * node.noise_px,
                                      node.slope_noise,
                                      1 / (node.slope_noise * node.slope_noise + 1e-8F),
                                      1,
                                      0};
      for (int k = 0; k < kNumbers; ++k) first[k * plane + column] = node.good ? values[k] : 0;
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
      for (int k = 0; k < kInputs; ++k) fusing.around[k] = place(at_row, column, k);
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
    for (int first = 0; first < columns_; first += kLanes) {
      float sums[kLanes], counts[kLanes];
      Cloned<sum_squares>::call(place(at_row, first, kVariance), static_cast<std::ptrdiff_t>(row), sums);
      Cloned<sum_squares>::call(place(at_row, first, kGood), static_cast<std::ptrdiff_t>(row), counts);
      for (int column = first; column < std::min(columns_, first + kLanes); ++column) {
        if (!nodes[column].good) continue;
        const float off = epipolar_.at({static_cast<float>(x_of(column)), static_cast<float>(y_of(at_row))});
        const float unknown = std::max(0.F, std::abs(off) - kUsualOffsetPx);
        nodes[column].sigma_px =
            std::sqrt(sums[column - first] / counts[column - first] + unknown * unknown + kFloorPx * kFloorPx);
      }
    }
  });
}

}  // namespace slsd
