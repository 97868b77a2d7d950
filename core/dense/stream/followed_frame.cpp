// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/stream/followed_frame.hpp"

#include <algorithm>
#include <cstring>

#include "core/appearance/align_patches.hpp"
#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

using enum Fitted::Unknown;
constexpr float kOfSlopeUnit = 1.F / 16;  // relative to the field's unit: slopes along a line are no multiples of it

/// Sums of the derivatives' products.
enum NormalSum {
  kGG,
  kYGG,
  kYYGG,
  kGP,
  kYGP,
  kYYGP,
  kPP,
  kYPP,
  kYYPP,
  kG,
  kYG,
  kP,
  kYP,
  kGC,
  kYGC,
  kPC,
  kYPC,
  kC,
  kCC,
  kOne,
  kNormalSums
};
constexpr int kNormalLanes = 3;
static_assert(kNormalSums <= kNormalLanes * kLanes);

/// Map of a node's plane for the pixels around it, in plain numbers.
struct BlockOf {
  float warp[9];  // row by row
  float origin_u, origin_v, along_u, along_v;
  const std::uint32_t* samples;
  int field_width, field_height;
  float slope_unit, of_slope_unit;  // of a slope's bits; the derivatives in it, for one
  const float *x, *y;               // pixels relative to the node's
  int count;                        // a multiple of kLanes
};

/// Computes the derivatives of the light, and the light, in the units in which they are kept.
inline __attribute__((always_inline)) void derive_lanes(const BlockOf& in, std::int16_t* along, std::int16_t* across,
                                                        std::int16_t* light) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;
  using Steps [[gnu::vector_size(16)]] = std::int16_t;
  const Lanes zero{}, one = zero + 1;
  const auto store = [](const Lanes& from, std::int16_t* to) __attribute__((always_inline)) {
    const Steps steps = __builtin_convertvector(from, Steps);
    std::memcpy(to, &steps, sizeof steps);
  };
  for (int first = 0; first < in.count; first += kLanes) {
    Lanes dx, dy;
    load(in.x + first, dx), load(in.y + first, dy);
    const Lanes per_q2 = one / (in.warp[6] * dx + in.warp[7] * dy + in.warp[8]);
    Lanes u = ((in.warp[0] * dx + in.warp[1] * dy + in.warp[2]) * per_q2 + in.origin_u) * kScale;
    Lanes v = ((in.warp[3] * dx + in.warp[4] * dy + in.warp[5]) * per_q2 + in.origin_v) * kScale;
    const Lanes last_u = zero + static_cast<float>(in.field_width - 2),
                last_v = zero + static_cast<float>(in.field_height - 2);
    u = u > zero ? u : zero, u = u < last_u ? u : last_u;
    v = v > zero ? v : zero, v = v < last_v ? v : last_v;
    const IntLanes at_u = __builtin_convertvector(u, IntLanes), at_v = __builtin_convertvector(v, IntLanes);
    const Lanes from_u = u - __builtin_convertvector(at_u, Lanes), from_v = v - __builtin_convertvector(at_v, Lanes);
    // Interpolate between four samples: a kept derivative has to be more exact than one that only directs a step.
    Lanes slope_u = zero, slope_v = zero, value = zero;
    for (int corner = 0; corner < 4; ++corner) {
      const int right = corner % 2, below = corner / 2;
      const IntLanes at = (at_v + below) * in.field_width + at_u + right;
      BitLanes bits;
      for (int lane = 0; lane < kLanes; ++lane) bits[lane] = in.samples[at[lane]];
      const Lanes weight = (right != 0 ? from_u : 1 - from_u) * (below != 0 ? from_v : 1 - from_v);
      const Lanes su =
          __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - 2 * kBits)) >> (32 - kBits), Lanes);
      const Lanes sv = __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - kBits)) >> (32 - kBits), Lanes);
      const Lanes off_u = from_u - static_cast<float>(right), off_v = from_v - static_cast<float>(below);
      slope_u += weight * su, slope_v += weight * sv;
      value += weight * (__builtin_convertvector(reinterpret_cast<IntLanes>(bits >> (2 * kBits)), Lanes) *
                             PatternField::kValueUnit +
                         (su * off_u + sv * off_v) * (in.slope_unit / kScale));
    }
    store((slope_u * in.along_u + slope_v * in.along_v) * in.of_slope_unit, along + first);
    store((slope_v * in.along_u - slope_u * in.along_v) * in.of_slope_unit, across + first);
    store(value * (1 / FollowedFrame::kLightUnit), light + first);
  }
}

/// The sums of NormalSum, as sum_columns() computes those of a difference.
struct NormalColumns {
  const std::uint16_t* pixels;
  const std::int16_t *along, *across, *light;
  std::ptrdiff_t width;
  int side, columns;
  float full, slope_unit;
};
inline __attribute__((always_inline)) void sum_normal_columns(const NormalColumns& in, float* to) {
  const Lanes zero{}, one = zero + 1;
  const int half = in.side / 2;
  for (int column = 0; column < in.columns; column += kLanes) {
    const int x = std::min(column, in.columns - kLanes);
    Lanes sums[kNormalSums];
    for (Lanes& sum : sums) sum = zero;
    for (int row = 0; row < in.side; ++row) {
      const std::ptrdiff_t at = row * in.width + x;
      Lanes level, g, c, p;
      load(in.pixels + at, level);
      load(in.along + at, g), load(in.across + at, c), load(in.light + at, p);
      const Lanes counted = level < in.full ? one : zero;
      g *= counted * in.slope_unit, c *= counted * in.slope_unit, p *= counted * FollowedFrame::kLightUnit;
      const auto y = static_cast<float>(row - half);
      const Lanes gg = g * g, gp = g * p, pp = p * p, gc = g * c, pc = p * c;
      sums[kGG] += gg, sums[kYGG] += y * gg, sums[kYYGG] += y * y * gg;
      sums[kGP] += gp, sums[kYGP] += y * gp, sums[kYYGP] += y * y * gp;
      sums[kPP] += pp, sums[kYPP] += y * pp, sums[kYYPP] += y * y * pp;
      sums[kG] += g, sums[kYG] += y * g, sums[kP] += p, sums[kYP] += y * p;
      sums[kGC] += gc, sums[kYGC] += y * gc, sums[kPC] += pc, sums[kYPC] += y * pc;
      sums[kC] += c, sums[kCC] += c * c, sums[kOne] += counted;
    }
    for (int lane = 0; lane < kLanes; ++lane)
      for (int k = 0; k < kNormalSums; ++k) to[kNormalLanes * kLanes * (x + lane) + k] = sums[k][lane];
  }
}

struct Moments {
  float plain[kNormalLanes * kLanes], by_x[kNormalLanes * kLanes], by_xx[kNormalLanes * kLanes];
};
inline __attribute__((always_inline)) void sum_moments(const float* columns, int side, Moments& to) {
  const int half = side / 2;
  for (int k = 0; k < kNormalLanes; ++k) {
    Lanes plain{}, by_x{}, by_xx{};
    for (int column = 0; column < side; ++column) {
      Lanes sums;
      load(columns + kLanes * (kNormalLanes * column + k), sums);
      const auto x = static_cast<float>(column - half);
      plain += sums, by_x += x * sums, by_xx += x * x * sums;
    }
    std::memcpy(to.plain + k * kLanes, &plain, sizeof plain), std::memcpy(to.by_x + k * kLanes, &by_x, sizeof by_x);
    std::memcpy(to.by_xx + k * kLanes, &by_xx, sizeof by_xx);
  }
}

/// One normal matrix for each lane, later its inverse.
struct EightNormals {
  Lanes of[kFitted][kFitted];
};

/// Inverts in place by Gauss and Jordan: a positive definite matrix needs no pivots.
inline __attribute__((always_inline)) void invert_eight(EightNormals& normals) {
  auto& m = normals.of;
  const Lanes one = Lanes{} + 1;
  for (int k = 0; k < kFitted; ++k) {
    const Lanes per_pivot = one / m[k][k];
    m[k][k] = one;
    for (int j = 0; j < kFitted; ++j) m[k][j] *= per_pivot;
    for (int i = 0; i < kFitted; ++i) {
      if (i == k) continue;
      const Lanes factor = m[i][k];
      m[i][k] = Lanes{};
      for (int j = 0; j < kFitted; ++j) m[i][j] -= factor * m[k][j];
    }
  }
}

void put_normal(const Moments& of, int lane, EightNormals& to) {
  const auto set = [&](Fitted::Unknown i, Fitted::Unknown j, float value) {
    to.of[i][j][lane] = to.of[j][i][lane] = value;
  };
  set(kOffset, kOffset, of.plain[kOne]), set(kOffset, kGain, of.plain[kP]), set(kOffset, kGainX, of.by_x[kP]);
  set(kOffset, kGainY, of.plain[kYP]), set(kOffset, kAcross, of.plain[kC]), set(kOffset, kSlopeX, of.by_x[kG]);
  set(kOffset, kSlopeY, of.plain[kYG]), set(kOffset, kDisparity, of.plain[kG]);
  set(kGain, kGain, of.plain[kPP]), set(kGain, kGainX, of.by_x[kPP]), set(kGain, kGainY, of.plain[kYPP]);
  set(kGain, kAcross, of.plain[kPC]), set(kGain, kSlopeX, of.by_x[kGP]), set(kGain, kSlopeY, of.plain[kYGP]);
  set(kGain, kDisparity, of.plain[kGP]);
  set(kGainX, kGainX, of.by_xx[kPP]), set(kGainX, kGainY, of.by_x[kYPP]), set(kGainX, kAcross, of.by_x[kPC]);
  set(kGainX, kSlopeX, of.by_xx[kGP]), set(kGainX, kSlopeY, of.by_x[kYGP]), set(kGainX, kDisparity, of.by_x[kGP]);
  set(kGainY, kGainY, of.plain[kYYPP]), set(kGainY, kAcross, of.plain[kYPC]), set(kGainY, kSlopeX, of.by_x[kYGP]);
  set(kGainY, kSlopeY, of.plain[kYYGP]), set(kGainY, kDisparity, of.plain[kYGP]);
  set(kAcross, kAcross, of.plain[kCC]), set(kAcross, kSlopeX, of.by_x[kGC]), set(kAcross, kSlopeY, of.plain[kYGC]);
  set(kAcross, kDisparity, of.plain[kGC]);
  set(kSlopeX, kSlopeX, of.by_xx[kGG]), set(kSlopeX, kSlopeY, of.by_x[kYGG]), set(kSlopeX, kDisparity, of.by_x[kGG]);
  set(kSlopeY, kSlopeY, of.plain[kYYGG]), set(kSlopeY, kDisparity, of.plain[kYGG]);
  set(kDisparity, kDisparity, of.plain[kGG]);
}

}  // namespace

std::size_t FollowedFrame::bytes() const {
  const auto of = [](const auto& held) { return held.capacity() * sizeof held[0]; };
  return of(pixels) + of(nodes) + of(tried) + of(found) + of(along) + of(across) + of(light) + of(inverses);
}

void FollowedFrame::find_derivatives(const SurfaceGrid& grid, Executor& executor) {
  const int stride = grid.stride_px();
  const int width = grid.frame_px().first, height = grid.frame_px().second;
  const std::size_t area = static_cast<std::size_t>(width) * height;
  along.assign(area, 0), across.assign(area, 0), light.assign(area, 0);
  slope_unit = kOfSlopeUnit * pattern.field(0).slope_unit();  // the narrowest blur has the steepest slopes
  const auto count = static_cast<std::size_t>((stride * stride + kLanes - 1) / kLanes * kLanes);
  std::vector<float> xs(count, 0), ys(count, 0);
  const int before = grid.x_of(0);  // number of pixels of a node's block left of it
  for (int i = 0; i < stride * stride; ++i)
    xs[i] = static_cast<float>(i % stride - before), ys[i] = static_cast<float>(i / stride - before);
  executor.run(grid.rows(), [&](int row, int) {
    std::int16_t of_block[3][256];
    for (int column = 0; column < grid.columns(); ++column) {
      const SurfaceNode* node = grid.good(column, row);
      if (node == nullptr) continue;
      const PatchMap map = grid.map_at(column, row, static_cast<double>(node->plane.inverse_depth));
      const float slope_x = node->plane.slope_x / node->per_px, slope_y = node->plane.slope_y / node->per_px;
      BlockOf block;
      for (int k = 0; k < 3; ++k) {
        block.warp[3 * k] = map.base(k, 0) + map.shift[k] * slope_x;
        block.warp[3 * k + 1] = map.base(k, 1) + map.shift[k] * slope_y;
        block.warp[3 * k + 2] = map.base(k, 2);
      }
      block.origin_u = static_cast<float>(map.origin_px.x() + PatternField::kBorderPx) - node->across * map.along.y();
      block.origin_v = static_cast<float>(map.origin_px.y() + PatternField::kBorderPx) + node->across * map.along.x();
      block.along_u = map.along.x(), block.along_v = map.along.y();
      const PatternField& field = pattern.field(node->blur);
      block.samples = field.samples(), block.field_width = field.width(), block.field_height = field.height();
      block.slope_unit = field.slope_unit(), block.of_slope_unit = field.slope_unit() / slope_unit;
      block.x = xs.data(), block.y = ys.data(), block.count = static_cast<int>(count);
      Cloned<derive_lanes>::call(block, of_block[0], of_block[1], of_block[2]);
      const int left = grid.x_of(column) - before, top = grid.y_of(row) - before;
      const int columns = std::min(stride, width - left), rows = std::min(stride, height - top);
      for (int y = 0; y < rows; ++y) {
        const std::size_t at = static_cast<std::size_t>(top + y) * width + left;
        std::copy_n(of_block[0] + y * stride, columns, along.data() + at);
        std::copy_n(of_block[1] + y * stride, columns, across.data() + at);
        std::copy_n(of_block[2] + y * stride, columns, light.data() + at);
      }
    }
  });
}

void FollowedFrame::find_inverses(const DenseFrame& frame, const SurfaceGrid& grid, int window_px, Executor& executor) {
  const int half = window_px / 2;
  const int width = grid.frame_px().first, height = grid.frame_px().second;
  inverses.assign(kPacked * nodes.size(), 0);
  std::vector<std::vector<float>> of_workers(static_cast<std::size_t>(executor.workers()));
  executor.run(grid.rows(), [&](int row, int worker) {
    const int y = grid.y_of(row);
    if (!within(y, half, height) || width < kLanes) return;
    std::vector<float>& columns = of_workers[worker];
    columns.resize(static_cast<std::size_t>(width) * kNormalLanes * kLanes);
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(y - half) * width;
    Cloned<sum_normal_columns>::call(
        NormalColumns{pixels.data() + first, along.data() + first, across.data() + first, light.data() + first, width,
                      window_px, width, static_cast<float>(full), slope_unit},
        columns.data());
    EightNormals normals;
    std::size_t indices[kLanes];
    int lanes = 0;
    const auto finish = [&] {
      for (int lane = lanes; lane < kLanes; ++lane)
        for (int i = 0; i < kFitted; ++i)
          for (int j = 0; j < kFitted; ++j) normals.of[i][j][lane] = i == j ? 1.F : 0.F;
      Cloned<invert_eight>::call(normals);
      for (int lane = 0; lane < lanes; ++lane) {
        float* inverse = inverses.data() + kPacked * indices[lane];
        for (int i = 0; i < kFitted; ++i)
          for (int j = i; j < kFitted; ++j) *inverse++ = normals.of[i][j][lane];
      }
      lanes = 0;
    };
    for (int column = 0; column < grid.columns(); ++column) {
      const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + column;
      const SurfaceNode& node = nodes[index];
      const int x = grid.x_of(column);
      if (!node.good || !within(x, half, width)) continue;
      Moments moments;
      Cloned<sum_moments>::call(columns.data() + static_cast<std::ptrdiff_t>(kNormalLanes * kLanes) * (x - half),
                                window_px, moments);
      put_normal(moments, lanes, normals);
      const AlignPriors<float> priors =
          align_priors(SurfaceGrid::kAlign, frame.noise.at(node.offset + 0.5F * node.gain), node.gain);
      normals.of[kAcross][kAcross][lanes] += priors.across;
      normals.of[kGainX][kGainX][lanes] += priors.gain_slope, normals.of[kGainY][kGainY][lanes] += priors.gain_slope;
      indices[lanes] = index;
      if (++lanes == kLanes) finish();
    }
    if (lanes > 0) finish();
  });
}

}  // namespace slsd
