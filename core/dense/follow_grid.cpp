// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/follow_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/clones.hpp"
#include "core/decode/lanes.hpp"

namespace slsd {
namespace {

/// Of the squares that the noise of both frames does in a window: more is a change. Chance does as much to one of
/// many thousands, and the noise is measured to some tenths of that.
constexpr float kStill = 1.6F;
/// How far a plane may move, projector px anywhere in its window: the model is linear there.
constexpr float kFollowPx = 0.1F;
/// The planes of a block of so many nodes to a side move by chance, each its own way: squares that are this much more
/// than noise makes them are a move of the surface, which is aligned: the derivatives are not exact enough for it.
constexpr int kBlockNodes = 8;
constexpr float kMovedTogether = 2;
/// Of the gain: how much the light may change.
constexpr float kGainChange = 0.1F;
/// Of the window's pixels: the others are saturated.
constexpr float kSeenMin = 0.7F;
/// Of a frame's nodes: fewer, and the next frame begins from nothing.
constexpr double kFollowedMin = 0.5;
/// So many more than went on have to stand still before another frame is kept, which takes some time itself.
constexpr double kStillMore = 0.2;
/// Windows of one in so many nodes are looked at for that.
constexpr std::size_t kSampled = 37;

constexpr int kPacked = kFitted * (kFitted + 1) / 2;
constexpr float kLightUnit = 1.F / 16384;
constexpr float kOfSlopeUnit = 1.F / 16;  // of the field's: slopes along a line are no multiples of it

/// The order of the unknowns.
enum Unknown { kOffset, kGain, kGainX, kGainY, kAcross, kSlopeX, kSlopeY, kDisparity };

/// Sums over the rows of a window, column by column, d being what the frame has more than the followed one.
enum ColumnSum { kDG, kYDG, kDP, kYDP, kD, kDC, kDD, kCounted };
/// Of the derivatives' products.
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

using Steps [[gnu::vector_size(16)]] = std::int16_t;

inline __attribute__((always_inline)) void load_steps(const std::int16_t* from, Lanes& to) {
  Steps steps;
  std::memcpy(&steps, from, sizeof steps);
  to = __builtin_convertvector(steps, Lanes);
}
template <class T>
inline __attribute__((always_inline)) void load_levels(const T* from, Lanes& to) {
  using Levels [[gnu::vector_size(kLanes * sizeof(T))]] = T;
  Levels levels;
  std::memcpy(&levels, from, sizeof levels);
  to = __builtin_convertvector(levels, Lanes);
}

/// A row of windows.
template <class T>
struct ColumnsOf {
  const T* pixels;              // the windows' upper left pixel, of the frame
  std::ptrdiff_t stride;        // of it
  const std::uint16_t* before;  // the same, of the followed one
  const std::int16_t *along, *across, *light;
  std::ptrdiff_t width;  // of these
  int side, columns;
  float full, slope_unit;
};

/// Eight columns at a time: a set of ColumnSum to each.
template <class T>
inline __attribute__((always_inline)) void sum_columns(const ColumnsOf<T>& in, float* to) {
  const Lanes zero{}, one = zero + 1;
  const int half = in.side / 2;
  for (int column = 0; column < in.columns; column += kLanes) {
    // The last ones overlap those before.
    const int x = std::min(column, in.columns - kLanes);
    Lanes sums[kLanes];
    for (Lanes& sum : sums) sum = zero;
    for (int row = 0; row < in.side; ++row) {
      const std::ptrdiff_t at = row * in.width + x;
      Lanes now, before, g, c, p;
      load_levels(in.pixels + row * in.stride + x, now), load_levels(in.before + at, before);
      load_steps(in.along + at, g), load_steps(in.across + at, c), load_steps(in.light + at, p);
      const Lanes counted = ((now < in.full) & (before < in.full)) ? one : zero;
      const Lanes d = counted * (now - before);
      const Lanes dg = d * g, dp = d * p;
      const auto y = static_cast<float>(row - half);
      sums[kDG] += dg, sums[kYDG] += y * dg, sums[kDP] += dp, sums[kYDP] += y * dp;
      sums[kD] += d, sums[kDC] += d * c, sums[kDD] += d * d, sums[kCounted] += counted;
    }
    sums[kDG] *= in.slope_unit, sums[kYDG] *= in.slope_unit, sums[kDC] *= in.slope_unit;
    sums[kDP] *= kLightUnit, sums[kYDP] *= kLightUnit;
    for (int lane = 0; lane < kLanes; ++lane)
      for (int k = 0; k < kLanes; ++k) to[kLanes * (x + lane) + k] = sums[k][lane];
  }
}
inline __attribute__((always_inline)) void sum_bytes(const ColumnsOf<std::uint8_t>& in, float* to) {
  sum_columns(in, to);
}
inline __attribute__((always_inline)) void sum_words(const ColumnsOf<std::uint16_t>& in, float* to) {
  sum_columns(in, to);
}
void call_sums(const ColumnsOf<std::uint8_t>& in, float* to) {
  Cloned<sum_bytes>::call(in, to);
}
void call_sums(const ColumnsOf<std::uint16_t>& in, float* to) {
  Cloned<sum_words>::call(in, to);
}

/// How far a node moves, by the sums of its window.
struct Move {
  float step[kFitted];           // in levels and, but for the last, gain times px
  float squares, left, counted;  // of d: all, and what the step leaves
};

/// @param columns  of the window's first column on
inline __attribute__((always_inline)) void find_move(const float* columns, int side, const float* inverse, Move& to) {
  Lanes plain{}, by_x{};
  const int half = side / 2;
  for (int column = 0; column < side; ++column) {
    Lanes sums;
    load(columns + kLanes * column, sums);
    plain += sums, by_x += static_cast<float>(column - half) * sums;
  }
  const float right[kFitted] = {plain[kD],  plain[kDP], by_x[kDP],   plain[kYDP],
                                plain[kDC], by_x[kDG],  plain[kYDG], plain[kDG]};
  to.squares = plain[kDD], to.counted = plain[kCounted];
  for (float& step : to.step) step = 0;
  for (int i = 0, at = 0; i < kFitted; ++i) {
    to.step[i] += inverse[at++] * right[i];
    for (int j = i + 1; j < kFitted; ++j, ++at) {
      to.step[i] += inverse[at] * right[j];
      to.step[j] += inverse[at] * right[i];
    }
  }
  float taken = 0;
  for (int i = 0; i < kFitted; ++i) taken += to.step[i] * right[i];
  to.left = to.squares - taken;
}

/// Where a node's plane sends the pixels around it, in plain numbers.
struct BlockOf {
  float warp[9];  // by rows
  float origin_u, origin_v, along_u, along_v;
  const std::uint32_t* samples;
  int field_width, field_height;
  float slope_unit;
  const float *x, *y;  // of the pixels, from the node's
  int count;           // a multiple of the lanes
};

/// The derivatives of the light there, and the light, in the steps that are kept.
inline __attribute__((always_inline)) void derive_lanes(const BlockOf& in, std::int16_t* along, std::int16_t* across,
                                                        std::int16_t* light) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;
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
    // Between four samples: a derivative that is kept has to be more exact than one that is only a step's direction.
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
    store((slope_u * in.along_u + slope_v * in.along_v) * (1 / kOfSlopeUnit), along + first);
    store((slope_v * in.along_u - slope_u * in.along_v) * (1 / kOfSlopeUnit), across + first);
    store(value * (1 / kLightUnit), light + first);
  }
}

/// The sums of NormalSum, as sum_columns() makes those of a difference.
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
      load_levels(in.pixels + at, level);
      load_steps(in.along + at, g), load_steps(in.across + at, c), load_steps(in.light + at, p);
      const Lanes counted = level < in.full ? one : zero;
      g *= counted * in.slope_unit, c *= counted * in.slope_unit, p *= counted * kLightUnit;
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

/// A normal matrix to a lane, and then its inverse.
struct EightNormals {
  Lanes of[kFitted][kFitted];
};

/// By Gauss and Jordan, in place: what is positive definite needs no pivots.
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
  const auto set = [&](Unknown i, Unknown j, float value) { to.of[i][j][lane] = to.of[j][i][lane] = value; };
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

void copy_levels(const GreyView& frame, std::vector<std::uint16_t>& to) {
  std::visit(
      [&](const auto& pixels) {
        to.resize(static_cast<std::size_t>(pixels.width) * pixels.height);
        for (int y = 0; y < pixels.height; ++y)
          std::copy_n(pixels.row(y), pixels.width, to.data() + static_cast<std::ptrdiff_t>(y) * pixels.width);
      },
      frame);
}

/// Whether a window around there lies within the frame.
bool within(int middle, int half, int size) {
  return middle >= half && middle + half < size;
}

}  // namespace

std::size_t FollowedFrame::bytes() const {
  const auto of = [](const auto& held) { return held.capacity() * sizeof held[0]; };
  return of(pixels) + of(nodes) + of(tried) + of(found) + of(along) + of(across) + of(light) + of(inverses);
}

std::size_t GridFollower::bytes() const {
  std::size_t bytes = last_.capacity() * sizeof last_[0] + moves_.capacity() * sizeof moves_[0];
  for (const auto& columns : columns_) bytes += columns.capacity() * sizeof columns[0];
  const std::lock_guard lock(shared_->mutex);
  return bytes + (shared_->frame ? shared_->frame->bytes() : 0);
}

void GridFollower::follow_row(const DenseFrame& frame, const FollowedFrame& from, SurfaceGrid& grid, int row,
                              int worker) {
  const int half = window_px_ / 2, y = grid.y_of(row);
  std::visit(
      [&](const auto& pixels) {
        if (!within(y, half, pixels.height) || pixels.width < kLanes) return;
        std::vector<float>& columns = columns_[worker];
        columns.resize(static_cast<std::size_t>(pixels.width) * kLanes);
        const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(y - half) * pixels.width;
        using T = std::remove_cvref_t<decltype(*pixels.pixels)>;
        call_sums(ColumnsOf<T>{pixels.row(y - half), pixels.stride, from.pixels.data() + first,
                               from.along.data() + first, from.across.data() + first, from.light.data() + first,
                               pixels.width, window_px_, pixels.width, static_cast<float>(frame.full), from.slope_unit},
                  columns.data());
        for (int column = 0; column < grid.columns(); ++column) {
          const int x = grid.x_of(column);
          if (!within(x, half, pixels.width)) continue;
          const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + column;
          const SurfaceNode& before = from.nodes[index];
          Move move;
          Cloned<find_move>::call(columns.data() + static_cast<std::ptrdiff_t>(kLanes) * (x - half), window_px_,
                                  from.inverses.data() + kPacked * index, move);
          const float level = before.good ? before.offset + 0.5F * before.gain : static_cast<float>(pixels.at(x, y));
          const float noise = frame.noise.at(level), of_pixel = 2 * kStill * noise * noise;
          if (!before.good) {
            if (from.tried[index] && move.squares <= of_pixel * move.counted) grid.close(index);
            continue;
          }
          const float window = static_cast<float>(window_px_ * window_px_), per_gain = 1 / before.gain;
          if (move.counted < kSeenMin * window || !(move.left <= of_pixel * (move.counted - kFitted))) continue;
          const float disparity = move.step[kDisparity] * per_gain, slope_x = move.step[kSlopeX] * per_gain,
                      slope_y = move.step[kSlopeY] * per_gain;
          if (!(std::abs(disparity) + static_cast<float>(half) * (std::abs(slope_x) + std::abs(slope_y)) < kFollowPx))
            continue;
          if (!(std::abs(move.step[kGain]) < kGainChange * before.gain)) continue;
          SurfaceNode& node = grid.nodes()[index];
          node = before;
          node.plane.inverse_depth += disparity * node.per_px;
          node.plane.slope_x += slope_x * node.per_px, node.plane.slope_y += slope_y * node.per_px;
          node.across += move.step[kAcross] * per_gain;
          node.offset += move.step[kOffset], node.gain += move.step[kGain];
          node.gain_x += move.step[kGainX], node.gain_y += move.step[kGainY];
          const float least = from.inverses[kPacked * index + kPacked - 1];  // of the disparity's variance
          moves_[index] = {move.step[kDisparity] * move.step[kDisparity], 2 * noise * noise * least};
        }
      },
      frame.pixels);
}

/// Takes blocks back whose planes move together, and counts what is left.
void GridFollower::stop_what_moves(SurfaceGrid& grid) {
  const auto each = [&](int top, int left, const auto& take) {
    for (int row = top; row < std::min(top + kBlockNodes, grid.rows()); ++row)
      for (int column = left; column < std::min(left + kBlockNodes, grid.columns()); ++column)
        take(static_cast<std::size_t>(row) * grid.columns() + column);
  };
  for (int top = 0; top < grid.rows(); top += kBlockNodes) {
    for (int left = 0; left < grid.columns(); left += kBlockNodes) {
      float moved = 0, by_noise = 0;
      std::size_t good = 0;
      each(top, left, [&](std::size_t index) {
        moved += moves_[index].square, by_noise += moves_[index].by_noise;
        good += grid.nodes()[index].good;
      });
      if (moved <= kMovedTogether * by_noise) {
        followed_ += good;
      } else {
        each(top, left, [&](std::size_t index) { grid.nodes()[index].good = false; });
      }
    }
  }
}

std::shared_ptr<const FollowedFrame> GridFollower::follow(const DenseFrame& frame, SurfaceGrid& grid,
                                                          Executor& executor) {
  grid.clear();
  followed_ = 0;
  std::shared_ptr<const FollowedFrame> from;
  {
    const std::lock_guard lock(shared_->mutex);
    from = shared_->frame;
  }
  const std::size_t pixels = std::visit(
      [](const auto& view) { return static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height); },
      frame.pixels);
  if (!from || from->pixels.size() != pixels || from->nodes.size() != grid.nodes().size() || from->full != frame.full)
    return nullptr;
  columns_.resize(std::max(columns_.size(), static_cast<std::size_t>(executor.workers())));
  moves_.assign(from->nodes.size(), {});
  executor.run(grid.rows(), [&](int row, int worker) { follow_row(frame, *from, grid, row, worker); });
  stop_what_moves(grid);
  if (static_cast<double>(followed_) >= kFollowedMin * static_cast<double>(from->good)) return from;
  grid.clear();
  followed_ = 0;
  return nullptr;
}

/// The share of the good nodes whose windows are as in the frame before, but for noise.
double GridFollower::still_share(const DenseFrame& frame, const SurfaceGrid& grid) const {
  std::size_t looked_at = 0, still = 0;
  const int half = window_px_ / 2;
  std::visit(
      [&](const auto& pixels) {
        if (last_.size() != static_cast<std::size_t>(pixels.width) * pixels.height) return;
        std::size_t good = 0;
        for (int row = 0; row < grid.rows(); ++row) {
          for (int column = 0; column < grid.columns(); ++column) {
            const SurfaceNode* node = grid.good(column, row);
            if (node == nullptr || good++ % kSampled != 0) continue;
            float squares = 0;
            for (int y = grid.y_of(row) - half; y <= grid.y_of(row) + half; ++y) {
              for (int x = grid.x_of(column) - half; x <= grid.x_of(column) + half; ++x) {
                const float off = static_cast<float>(pixels.at(x, y)) -
                                  static_cast<float>(last_[static_cast<std::size_t>(y) * pixels.width + x]);
                squares += off * off;
              }
            }
            const float noise = frame.noise.at(node->offset + 0.5F * node->gain);
            ++looked_at;
            still += squares <= 2 * kStill * noise * noise * static_cast<float>(window_px_ * window_px_);
          }
        }
      },
      frame.pixels);
  return looked_at == 0 ? 0 : static_cast<double>(still) / static_cast<double>(looked_at);
}

void GridFollower::find_derivatives(const PatternField& field, const SurfaceGrid& grid, FollowedFrame& to,
                                    Executor& executor) {
  const int stride = grid.stride_px();
  const int width = grid.frame_px().first, height = grid.frame_px().second;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  to.along.assign(pixels, 0), to.across.assign(pixels, 0), to.light.assign(pixels, 0);
  to.slope_unit = kOfSlopeUnit * field.slope_unit();
  const auto count = static_cast<std::size_t>((stride * stride + kLanes - 1) / kLanes * kLanes);
  std::vector<float> xs(count, 0), ys(count, 0);
  const int before = grid.x_of(0);  // pixels of a node's block left of it
  for (int i = 0; i < stride * stride; ++i)
    xs[i] = static_cast<float>(i % stride - before), ys[i] = static_cast<float>(i / stride - before);
  executor.run(grid.rows(), [&](int row, int) {
    std::int16_t along[256], across[256], light[256];
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
      block.samples = field.samples(), block.field_width = field.width(), block.field_height = field.height();
      block.slope_unit = field.slope_unit();
      block.x = xs.data(), block.y = ys.data(), block.count = static_cast<int>(count);
      Cloned<derive_lanes>::call(block, along, across, light);
      const int left = grid.x_of(column) - before, top = grid.y_of(row) - before;
      const int columns = std::min(stride, width - left), rows = std::min(stride, height - top);
      for (int y = 0; y < rows; ++y) {
        const std::size_t at = static_cast<std::size_t>(top + y) * width + left;
        std::copy_n(along + y * stride, columns, to.along.data() + at);
        std::copy_n(across + y * stride, columns, to.across.data() + at);
        std::copy_n(light + y * stride, columns, to.light.data() + at);
      }
    }
  });
}

void GridFollower::find_inverses(const DenseFrame& frame, const SurfaceGrid& grid, FollowedFrame& to,
                                 Executor& executor) {
  const int half = window_px_ / 2;
  const int width = grid.frame_px().first, height = grid.frame_px().second;
  to.inverses.assign(kPacked * to.nodes.size(), 0);
  columns_.resize(std::max(columns_.size(), static_cast<std::size_t>(executor.workers())));
  executor.run(grid.rows(), [&](int row, int worker) {
    const int y = grid.y_of(row);
    if (!within(y, half, height) || width < kLanes) return;
    std::vector<float>& columns = columns_[worker];
    columns.resize(static_cast<std::size_t>(width) * kNormalLanes * kLanes);
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(y - half) * width;
    Cloned<sum_normal_columns>::call(
        NormalColumns{to.pixels.data() + first, to.along.data() + first, to.across.data() + first,
                      to.light.data() + first, width, window_px_, width, static_cast<float>(to.full), to.slope_unit},
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
        float* inverse = to.inverses.data() + kPacked * indices[lane];
        for (int i = 0; i < kFitted; ++i)
          for (int j = i; j < kFitted; ++j) *inverse++ = normals.of[i][j][lane];
      }
      lanes = 0;
    };
    for (int column = 0; column < grid.columns(); ++column) {
      const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + column;
      const SurfaceNode& node = to.nodes[index];
      const int x = grid.x_of(column);
      if (!node.good || !within(x, half, width)) continue;
      Moments moments;
      Cloned<sum_moments>::call(columns.data() + static_cast<std::ptrdiff_t>(kNormalLanes * kLanes) * (x - half),
                                window_px_, moments);
      put_normal(moments, lanes, normals);
      const AlignPriors priors =
          align_priors(SurfaceGrid::kAlign, frame.noise.at(node.offset + 0.5F * node.gain), node.gain);
      normals.of[kAcross][kAcross][lanes] += priors.across;
      normals.of[kGainX][kGainX][lanes] += priors.gain_slope, normals.of[kGainY][kGainY][lanes] += priors.gain_slope;
      indices[lanes] = index;
      if (++lanes == kLanes) finish();
    }
    if (lanes > 0) finish();
  });
}

void GridFollower::keep(const DenseFrame& frame, const PatternField& field, std::size_t blur, const SurfaceGrid& grid,
                        std::span<const SurfaceSeed> found, Executor& executor) {
  kept_.reset();
  std::size_t good = 0;
  for (const SurfaceNode& node : grid.nodes()) good += node.good;
  const double all = static_cast<double>(std::max<std::size_t>(1, good)), share = static_cast<double>(followed_) / all;
  if (share < 1 - kStillMore && still_share(frame, grid) > share + kStillMore) {
    kept_ = std::make_shared<FollowedFrame>();
    copy_levels(frame.pixels, kept_->pixels);
    kept_->full = frame.full, kept_->blur = blur, kept_->epipolar = grid.epipolar_offset();
    kept_->nodes.assign(grid.nodes().begin(), grid.nodes().end());
    for (const SurfaceSeed& seed : found)
      if (grid.good_at(seed.camera_px)) kept_->found.push_back(seed);
    find_derivatives(field, grid, *kept_, executor);
    find_inverses(frame, grid, *kept_, executor);
  }
  copy_levels(frame.pixels, last_);
}

void GridFollower::finish(const DenseMap& map, const SurfaceGrid& grid) {
  if (!kept_) return;
  kept_->tried.resize(kept_->nodes.size());
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + column;
      SurfaceNode& node = kept_->nodes[index];
      kept_->tried[index] = !node.good;
      node.good = node.good && map.measured(static_cast<std::size_t>(grid.y_of(row)) * map.width + grid.x_of(column));
      kept_->good += node.good;
    }
  }
  const std::lock_guard lock(shared_->mutex);
  shared_->frame = std::move(kept_);
}

}  // namespace slsd
