// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/stream/follow_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Ratio of a window's sum of squares to that expected from the noise of both frames; more is a change. Chance exceeds
/// it in one of many thousands; the noise is known to some tenths of that.
constexpr float kStill = 1.6F;
/// Largest move of a plane, projector px anywhere in its window, for which the model is linear.
constexpr float kFollowPx = 0.1F;
/// Side of a block of nodes. By chance, its planes move independently. If the sum of squares is this much above the
/// noise, the surface moves, and the block is aligned: the derivatives are not exact enough to follow it.
constexpr int kBlockNodes = 8;
constexpr float kMovedTogether = 2;
/// Largest change of the light, as a share of the gain.
constexpr float kGainChange = 0.1F;
/// Least number of a window's unsaturated pixels for each fitted parameter.
constexpr float kSeenMin = 4;
/// Smallest share of a frame's nodes that continue; with fewer, the next frame starts afresh.
constexpr double kFollowedMin = 0.5;
/// One row of blocks in so many is followed first. If fewer nodes of it continue than this share, the scene moves, and
/// the others do not continue either.
constexpr int kSampledBlocks = 4;
constexpr double kSampledMin = 0.5 * kFollowedMin;
/// Excess of still nodes over continued ones above which a new frame is kept, which itself takes time.
constexpr double kStillMore = 0.2;
/// Interval at which windows are sampled to count still nodes.
constexpr std::size_t kSampled = 37;

using enum Fitted::Unknown;
constexpr int kPacked = FollowedFrame::kPacked;

/// Sums over the rows of a window, column by column; d is the frame minus the followed frame.
enum ColumnSum { kDG, kYDG, kDP, kYDP, kD, kDC, kDD, kCounted };
/// A row of windows.
template <class T>
struct ColumnsOf {
  const T* pixels;              // the windows' upper left pixel in the frame
  std::ptrdiff_t stride;        // stride of the frame
  const std::uint16_t* before;  // the same pixel in the followed frame
  const std::int16_t *along, *across, *light;
  std::ptrdiff_t width;  // stride of the followed frame and of the derivatives
  int side, columns;
  float full, slope_unit;
};

/// Eight columns at a time: a set of ColumnSum to each.
template <class T>
inline __attribute__((always_inline)) void sum_columns(const ColumnsOf<T>& in, float* to) {
  const Lanes zero{}, one = zero + 1;
  const int half = in.side / 2;
  for (int column = 0; column < in.columns; column += kLanes) {
    // The last group overlaps the one before.
    const int x = std::min(column, in.columns - kLanes);
    Lanes sums[kLanes];
    for (Lanes& sum : sums) sum = zero;
    for (int row = 0; row < in.side; ++row) {
      const std::ptrdiff_t at = row * in.width + x;
      Lanes now, before, g, c, p;
      load(in.pixels + row * in.stride + x, now), load(in.before + at, before);
      load(in.along + at, g), load(in.across + at, c), load(in.light + at, p);
      const Lanes counted = ((now < in.full) & (before < in.full)) ? one : zero;
      const Lanes d = counted * (now - before);
      const Lanes dg = d * g, dp = d * p;
      const auto y = static_cast<float>(row - half);
      sums[kDG] += dg, sums[kYDG] += y * dg, sums[kDP] += dp, sums[kYDP] += y * dp;
      sums[kD] += d, sums[kDC] += d * c, sums[kDD] += d * d, sums[kCounted] += counted;
    }
    sums[kDG] *= in.slope_unit, sums[kYDG] *= in.slope_unit, sums[kDC] *= in.slope_unit;
    sums[kDP] *= FollowedFrame::kLightUnit, sums[kYDP] *= FollowedFrame::kLightUnit;
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

/// Move of a node, from the sums of its window.
struct Move {
  float step[kFitted];           // in levels; all but the last are gain times px
  float squares, left, counted;  // of d: all, and the rest after the step
};

/// @param columns  sums from the window's first column on
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

/// Tells whether a row of nodes is in a sampled row of blocks.
bool is_sampled(int row) {
  return row / kBlockNodes % kSampledBlocks == 0;
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

}  // namespace

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
          const float per_gain = 1 / before.gain;
          if (move.counted < kSeenMin * kFitted || !(move.left <= of_pixel * (move.counted - kFitted))) continue;
          const float disparity = move.step[kDisparity] * per_gain, slope_x = move.step[kSlopeX] * per_gain,
                      slope_y = move.step[kSlopeY] * per_gain;
          if (!(std::abs(disparity) + static_cast<float>(half) * (std::abs(slope_x) + std::abs(slope_y)) < kFollowPx))
            continue;
          if (!(std::abs(move.step[kGain]) < kGainChange * before.gain)) continue;
          SurfaceNode& node = grid.nodes()[index];
          node = before;
          node.plane.inverse_depth += disparity * node.per_px;
          node.plane.slope_x += slope_x * node.per_px, node.plane.slope_y += slope_y * node.per_px;
          const float across = move.step[kAcross] * per_gain;
          node.across += across;
          node.offset += move.step[kOffset], node.gain += move.step[kGain];
          node.gain_x += move.step[kGainX], node.gain_y += move.step[kGainY];
          const float least = from.inverses[kPacked * index + kPacked - 1];  // variance of the disparity
          moves_[index] = {move.step[kDisparity] * move.step[kDisparity], 2 * noise * noise * least, across};
        }
      },
      frame.pixels);
}

/// Gives up blocks whose planes move together, and counts the rest.
/// @param sampled  whether to do so in the sampled rows of blocks, or in all others
/// @return the sum of their moves across the epipolar lines
float GridFollower::stop_what_moves(SurfaceGrid& grid, bool sampled) {
  float across = 0;
  const auto each = [&](int top, int left, const auto& take) {
    for (int row = top; row < std::min(top + kBlockNodes, grid.rows()); ++row)
      for (int column = left; column < std::min(left + kBlockNodes, grid.columns()); ++column)
        take(static_cast<std::size_t>(row) * grid.columns() + column);
  };
  for (int top = 0; top < grid.rows(); top += kBlockNodes) {
    if (is_sampled(top) != sampled) continue;
    for (int left = 0; left < grid.columns(); left += kBlockNodes) {
      float moved = 0, by_noise = 0, off = 0;
      std::size_t good = 0;
      each(top, left, [&](std::size_t index) {
        moved += moves_[index].square, by_noise += moves_[index].by_noise, off += moves_[index].across_px;
        good += grid.nodes()[index].good;
      });
      if (moved <= kMovedTogether * by_noise) {
        followed_ += good, across += off;
      } else {
        each(top, left, [&](std::size_t index) { grid.nodes()[index].good = false; });
      }
    }
  }
  return across;
}

float GridFollower::tone_power() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->frame ? shared_->frame->tone_power : 1;
}

std::shared_ptr<const FollowedFrame> GridFollower::follow(const DenseFrame& frame, SurfaceGrid& grid,
                                                          Executor& executor) {
  grid.clear();
  followed_ = 0, across_px_ = 0;
  std::shared_ptr<const FollowedFrame> from;
  {
    const std::lock_guard lock(shared_->mutex);
    from = shared_->frame;
  }
  const auto [width, height] = size_of(frame.pixels);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (!from || from->pixels.size() != pixels || from->nodes.size() != grid.nodes().size() || from->full != frame.full ||
      from->tone_power != frame.tone_power)
    return nullptr;
  columns_.resize(std::max(columns_.size(), static_cast<std::size_t>(executor.workers())));
  moves_.assign(from->nodes.size(), {});
  float across = 0;
  const auto follow_rows = [&](bool sampled, double share, std::size_t of) {
    executor.run(grid.rows(), [&](int row, int worker) {
      if (is_sampled(row) == sampled) follow_row(frame, *from, grid, row, worker);
    });
    across += stop_what_moves(grid, sampled);
    return static_cast<double>(followed_) >= share * static_cast<double>(of);
  };
  if (follow_rows(true, kSampledMin, from->good_sampled) && follow_rows(false, kFollowedMin, from->good)) {
    across_px_ = across / static_cast<float>(std::max<std::size_t>(1, followed_));
    return from;
  }
  grid.clear();
  followed_ = 0, across_px_ = 0;
  return nullptr;
}

/// The share of the good nodes whose windows equal those of the previous frame, apart from noise.
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
            // A window at the border of the frame is seen in part.
            const int left = std::max(0, grid.x_of(column) - half), top = std::max(0, grid.y_of(row) - half);
            const int right = std::min(pixels.width, grid.x_of(column) + half + 1),
                      bottom = std::min(pixels.height, grid.y_of(row) + half + 1);
            for (int y = top; y < bottom; ++y) {
              for (int x = left; x < right; ++x) {
                const float off = static_cast<float>(pixels.at(x, y)) -
                                  static_cast<float>(last_[static_cast<std::size_t>(y) * pixels.width + x]);
                squares += off * off;
              }
            }
            const float noise = frame.noise.at(node->offset + 0.5F * node->gain);
            ++looked_at;
            still += squares <= 2 * kStill * noise * noise * static_cast<float>((right - left) * (bottom - top));
          }
        }
      },
      frame.pixels);
  return looked_at == 0 ? 0 : static_cast<double>(still) / static_cast<double>(looked_at);
}

void GridFollower::keep(const DenseFrame& frame, const BlurredPattern& pattern, const SurfaceGrid& grid,
                        std::span<const SurfaceSeed> found, Executor& executor) {
  kept_.reset();
  std::size_t good = 0;
  for (const SurfaceNode& node : grid.nodes()) good += node.good;
  const double all = static_cast<double>(std::max<std::size_t>(1, good)), share = static_cast<double>(followed_) / all;
  if (share < 1 - kStillMore && still_share(frame, grid) > share + kStillMore) {
    kept_ = std::make_shared<FollowedFrame>();
    copy_levels(frame.pixels, kept_->pixels);
    kept_->full = frame.full, kept_->tone_power = frame.tone_power, kept_->pattern = pattern,
    kept_->epipolar = grid.epipolar_offset();
    kept_->nodes.assign(grid.nodes().begin(), grid.nodes().end());
    for (const SurfaceSeed& seed : found)
      if (grid.good_at(seed.camera_px)) kept_->found.push_back(seed);
    kept_->find_derivatives(grid, executor);
    kept_->find_inverses(frame, grid, window_px_, executor);
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
      if (is_sampled(row)) kept_->good_sampled += node.good;
    }
  }
  const std::lock_guard lock(shared_->mutex);
  shared_->frame = std::move(kept_);
}

}  // namespace slsd
