// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/weigh_patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/clones.hpp"

namespace slsd {
namespace {

constexpr Lanes kLane = {0, 1, 2, 3, 4, 5, 6, 7};

inline __attribute__((always_inline)) void find_levels_of(const float* patch, int count, const PatchRange& range,
                                                          PatchLevels& levels) {
  const float quarter = 0.25F * (range.greatest - range.least);
  const Lanes low_limit = Lanes{} + (range.least + quarter), high_limit = Lanes{} + (range.greatest - quarter);
  const Lanes zero{};
  Lanes low_sum{}, high_sum{}, high_squares{};
  IntLanes low_count{}, high_count{};  // negative: a comparison that holds is -1
  for (int i = 0; i < count; i += kLanes) {
    Lanes value;
    load(patch + i, value);
    const IntLanes is_low = value <= low_limit, is_high = value >= high_limit;
    const Lanes above = is_high ? value - high_limit : zero;
    low_sum += is_low ? value : zero;
    low_count += is_low;
    high_sum += above;
    high_squares += above * above;
    high_count += is_high;
  }
  levels = {};
  const float lows = -sum_of(__builtin_convertvector(low_count, Lanes)),
              highs = -sum_of(__builtin_convertvector(high_count, Lanes));
  if (lows == 0 || highs == 0) return;
  const float mean = sum_of(high_sum) / highs;
  levels.background = sum_of(low_sum) / lows;
  levels.peak = high_limit[0] + mean;
  levels.noise = std::sqrt(std::max(0.F, sum_of(high_squares) / highs - mean * mean));
}

inline __attribute__((always_inline)) void sum_moments_of(const float* patch, int stride, int height, float middle_x,
                                                          float middle_y, const PatchLevels& levels,
                                                          RawMoments& moments) {
  const float range = levels.peak - levels.background;
  const Lanes zero{}, one = zero + 1;
  const Lanes offset = zero + (levels.background + kRampStart * range);
  const Lanes scale = zero + 1 / ((kRampEnd - kRampStart) * range);
  const Lanes centre_offset = zero + (levels.background + kCentreRampStart * range);
  const Lanes centre_scale = zero + 1 / ((kCentreRampEnd - kCentreRampStart) * range);
  Lanes centre{}, centre_x{}, centre_y{};
  // Sums over y stay in their columns, and are then taken over x; lanes are summed once at the end.
  Lanes m00{}, m01{}, m02{}, m03{}, m10{}, m11{}, m12{}, m20{}, m21{}, m30{};
  for (int left = 0; left < stride; left += kLanes) {
    Lanes s0{}, s1{}, s2{}, s3{}, c0{}, y = zero - middle_y;
    for (int row = 0; row < height; ++row) {
      Lanes grey;
      load(patch + row * stride + left, grey);
      Lanes c = (grey - centre_offset) * centre_scale;
      c = c > zero ? c : zero;
      c = c < one ? c : one;
      c0 += c;
      centre_y += c * y;
      Lanes w = (grey - offset) * scale;
      w = w > zero ? w : zero;
      w = w < one ? w : one;
      const Lanes wy = w * y, wyy = wy * y;
      s0 += w;
      s1 += wy;
      s2 += wyy;
      s3 += wyy * y;
      y += one;
    }
    const Lanes x = kLane + (static_cast<float>(left) - middle_x);
    centre += c0, centre_x += c0 * x;
    const Lanes x0 = s0 * x, x1 = s1 * x, xx0 = x0 * x;
    m00 += s0, m01 += s1, m02 += s2, m03 += s3;
    m10 += x0, m11 += x1, m12 += s2 * x;
    m20 += xx0, m21 += x1 * x;
    m30 += xx0 * x;
  }
  moments.centre = sum_of(centre), moments.centre_x = sum_of(centre_x), moments.centre_y = sum_of(centre_y);
  auto& m = moments.m;
  m[0][0] = sum_of(m00), m[0][1] = sum_of(m01), m[0][2] = sum_of(m02), m[0][3] = sum_of(m03);
  m[1][0] = sum_of(m10), m[1][1] = sum_of(m11), m[1][2] = sum_of(m12);
  m[2][0] = sum_of(m20), m[2][1] = sum_of(m21);
  m[3][0] = sum_of(m30);
}

}  // namespace

PatchRange range_of(const float* patch, int count) {
  PatchRange range;
  for (int i = 0; i < count; ++i) {
    if (patch[i] < range.least) range.least = patch[i];
    if (patch[i] > range.greatest) range.greatest = patch[i];
  }
  return range;
}

void find_levels(const float* patch, int count, const PatchRange& range, PatchLevels& levels) {
  Cloned<find_levels_of>::call(patch, count, range, levels);
}

void sum_moments(const float* patch, int stride, int height, float middle_x, float middle_y, const PatchLevels& levels,
                 RawMoments& moments) {
  Cloned<sum_moments_of>::call(patch, stride, height, middle_x, middle_y, levels, moments);
}

}  // namespace slsd
