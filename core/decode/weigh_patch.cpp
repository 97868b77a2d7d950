// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/weigh_patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/decode/clones.hpp"

namespace slsd {
namespace {

constexpr Lanes kLane = {0, 1, 2, 3, 4, 5, 6, 7};
constexpr float kGreatest = std::numeric_limits<float>::max();

}  // namespace

SLSD_CLONES void find_levels(const float* patch, int count, PatchLevels& levels) {
  const Lanes zero{};
  Lanes lowest = zero + kGreatest, highest = zero;
  for (int i = 0; i < count; i += kLanes) {
    Lanes value;
    load(patch + i, value);
    const Lanes inside = value < zero ? zero + kGreatest : value;
    highest = value > highest ? value : highest;
    lowest = inside < lowest ? inside : lowest;
  }
  float low = lowest[0], high = highest[0];
  for (int lane = 1; lane < kLanes; ++lane) low = std::min(low, lowest[lane]), high = std::max(high, highest[lane]);

  const Lanes low_limit = zero + (low + 0.25F * (high - low)), high_limit = zero + (high - 0.25F * (high - low));
  const Lanes one = zero + 1;
  Lanes low_sum{}, low_count{}, high_sum{}, high_squares{}, high_count{};
  for (int i = 0; i < count; i += kLanes) {
    Lanes value;
    load(patch + i, value);
    const Lanes is_low = (value >= zero) & (value <= low_limit) ? one : zero;
    const Lanes is_high = value >= high_limit ? one : zero;
    const Lanes above = is_high * (value - high_limit);
    low_sum += is_low * value;
    low_count += is_low;
    high_sum += above;
    high_squares += above * above;
    high_count += is_high;
  }
  levels = {};
  const float lows = sum_of(low_count), highs = sum_of(high_count);
  if (lows == 0 || highs == 0) return;
  const float mean = sum_of(high_sum) / highs;
  levels.background = sum_of(low_sum) / lows;
  levels.peak = high_limit[0] + mean;
  levels.noise = std::sqrt(std::max(0.F, sum_of(high_squares) / highs - mean * mean));
}

SLSD_CLONES void sum_moments(const float* patch, int stride, int height, float middle_x, float middle_y,
                             const PatchLevels& levels, RawMoments& moments) {
  const float range = levels.peak - levels.background;
  const Lanes zero{}, one = zero + 1;
  const Lanes offset = zero + (levels.background + kRampStart * range);
  const Lanes scale = zero + 1 / ((kRampEnd - kRampStart) * range);
  // Sums over y stay in their columns, and are then taken over x; lanes are summed once at the end.
  Lanes m00{}, m01{}, m02{}, m03{}, m10{}, m11{}, m12{}, m20{}, m21{}, m30{};
  for (int left = 0; left < stride; left += kLanes) {
    Lanes s0{}, s1{}, s2{}, s3{};
    for (int row = 0; row < height; ++row) {
      Lanes w;
      load(patch + row * stride + left, w);
      w = (w - offset) * scale;
      w = w > zero ? w : zero;
      w = w < one ? w : one;
      const Lanes y = zero + (static_cast<float>(row) - middle_y);
      const Lanes wy = w * y, wyy = wy * y;
      s0 += w;
      s1 += wy;
      s2 += wyy;
      s3 += wyy * y;
    }
    const Lanes x = kLane + (static_cast<float>(left) - middle_x);
    const Lanes x0 = s0 * x, x1 = s1 * x, xx0 = x0 * x;
    m00 += s0, m01 += s1, m02 += s2, m03 += s3;
    m10 += x0, m11 += x1, m12 += s2 * x;
    m20 += xx0, m21 += x1 * x;
    m30 += xx0 * x;
  }
  auto& m = moments.m;
  m[0][0] = sum_of(m00), m[0][1] = sum_of(m01), m[0][2] = sum_of(m02), m[0][3] = sum_of(m03);
  m[1][0] = sum_of(m10), m[1][1] = sum_of(m11), m[1][2] = sum_of(m12);
  m[2][0] = sum_of(m20), m[2][1] = sum_of(m21);
  m[3][0] = sum_of(m30);
}

}  // namespace slsd
