// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/weigh_patch.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include "core/clones.hpp"

namespace slsd {
namespace {

inline __attribute__((always_inline)) void load_grey(const float* from, Lanes& grey) {
  load(from, grey);
}
inline __attribute__((always_inline)) void load_grey(const std::int16_t* from, Lanes& grey) {
  using Half [[gnu::vector_size(2 * kLanes)]] = std::int16_t;
  static_assert(std::endian::native == std::endian::little);
  Half shorts;
  std::memcpy(&shorts, from, sizeof shorts);
  // No value is negative, so one shuffle widens them; a conversion takes four instructions.
  const auto wide = __builtin_shufflevector(shorts, Half{}, 0, 8, 1, 8, 2, 8, 3, 8, 4, 8, 5, 8, 6, 8, 7, 8);
  grey = __builtin_convertvector(reinterpret_cast<IntLanes>(wide), Lanes);
}

/// Clamps to between 0 and 1; kOutside becomes 0.
template <class Pixel>
inline __attribute__((always_inline)) void clamp_weight(Lanes& weight) {
  if constexpr (std::is_same_v<Pixel, float>) {
    const Lanes zero{}, one = zero + 1;
    weight = weight > zero ? weight : zero;
    weight = weight < one ? weight : one;
  } else {
    // Compare the bits as integers, which have the order of the floats from zero on: one instruction, where GCC makes
    // two for floats.
    const IntLanes zero{}, one = zero + std::bit_cast<int>(1.F);
    auto bits = reinterpret_cast<IntLanes>(weight);
    bits = bits > zero ? bits : zero;
    bits = bits < one ? bits : one;
    weight = reinterpret_cast<Lanes>(bits);
  }
}

inline __attribute__((always_inline)) void find_levels_of(const float* patch, int count, const PatchRange& range,
                                                          PatchLevels& levels) {
  const float quarter = 0.25F * (range.greatest - range.least);
  const Lanes low_limit = Lanes{} + (range.least + quarter), high_limit = Lanes{} + (range.greatest - quarter);
  const Lanes zero{};
  Lanes low_sum{}, high_sum{};
  IntLanes low_count{}, high_count{};  // negative, as a true comparison gives -1
  for (int i = 0; i < count; i += kLanes) {
    Lanes value;
    load(patch + i, value);
    const IntLanes is_low = value <= low_limit, is_high = value >= high_limit;
    const Lanes above = is_high ? value - high_limit : zero;
    low_sum += is_low ? value : zero;
    low_count += is_low;
    high_sum += above;
    high_count += is_high;
  }
  levels = {};
  const float lows = -sum_of(__builtin_convertvector(low_count, Lanes)),
              highs = -sum_of(__builtin_convertvector(high_count, Lanes));
  if (lows == 0 || highs == 0) return;
  const float mean = sum_of(high_sum) / highs;
  levels.background = sum_of(low_sum) / lows;
  levels.peak = high_limit[0] + mean;
}

template <class Pixel, bool kSteady>
inline __attribute__((always_inline)) void sum_moments_of(const Pixel* patch, int stride, int width,
                                                          std::span<const RowPowers> rows, float middle_x,
                                                          const PatchLevels& levels, RawMoments& moments) {
  const float range = levels.peak - levels.background;
  const Lanes zero{};
  const float per_range = 1 / ((kRampEnd - kRampStart) * range),
              per_centre_range = 1 / ((kCentreRampEnd - kCentreRampStart) * range);
  const Lanes scale = zero + per_range, start = zero + (levels.background + kRampStart * range) * per_range;
  const Lanes centre_scale = zero + per_centre_range,
              centre_start = zero + (levels.background + kCentreRampStart * range) * per_centre_range;
  const Lanes steady_scale = zero + (kCentreRampEnd - kCentreRampStart) / (kSteadyRampEnd - kCentreRampStart);
  Lanes centre{}, centre_x{}, centre_y{}, steady{}, steady_x{}, steady_y{};
  // Sum over y within columns, then over x; sum the lanes once at the end.
  Lanes m00{}, m01{}, m02{}, m03{}, m10{}, m11{}, m12{}, m20{}, m21{}, m30{};
  for (int left = 0; left < width; left += kLanes) {
    Lanes s0{}, s1{}, s2{}, s3{}, c0{}, t0{};
    const Pixel* pixels = patch + left;
    for (const RowPowers& row : rows) {
      Lanes grey;
      load_grey(pixels, grey);
      pixels += stride;
      Lanes c = grey * centre_scale - centre_start, w = grey * scale - start;
      if constexpr (kSteady) {
        // Both ramps begin at the same level.
        Lanes t = c * steady_scale;
        clamp_weight<Pixel>(t);
        t0 += t;
        steady_y += t * row.y;
      }
      clamp_weight<Pixel>(c);
      clamp_weight<Pixel>(w);
      c0 += c;
      centre_y += c * row.y;
      s0 += w;
      s1 += w * row.y;
      s2 += w * row.yy;
      s3 += w * row.yyy;
    }
    const Lanes x = kLane + (static_cast<float>(left) - middle_x);
    centre += c0, centre_x += c0 * x;
    if constexpr (kSteady) steady += t0, steady_x += t0 * x;
    const Lanes x0 = s0 * x, x1 = s1 * x, xx0 = x0 * x;
    m00 += s0, m01 += s1, m02 += s2, m03 += s3;
    m10 += x0, m11 += x1, m12 += s2 * x;
    m20 += xx0, m21 += x1 * x;
    m30 += xx0 * x;
  }
  moments.centre = sum_of(centre), moments.centre_x = sum_of(centre_x), moments.centre_y = sum_of(centre_y);
  if constexpr (kSteady)
    moments.steady = sum_of(steady), moments.steady_x = sum_of(steady_x), moments.steady_y = sum_of(steady_y);
  auto& m = moments.m;
  m[0][0] = sum_of(m00), m[0][1] = sum_of(m01), m[0][2] = sum_of(m02), m[0][3] = sum_of(m03);
  m[1][0] = sum_of(m10), m[1][1] = sum_of(m11), m[1][2] = sum_of(m12);
  m[2][0] = sum_of(m20), m[2][1] = sum_of(m21);
  m[3][0] = sum_of(m30);
}

constexpr int kShortLanes = 16;
using Shorts [[gnu::vector_size(2 * kShortLanes)]] = std::int16_t;
using WideShorts [[gnu::vector_size(4 * kShortLanes)]] = int;
/// Limits of a patch in registers, for symbols up to 40 px: sums of that many grey values stay within 15 bits.
constexpr int kShortsMax = 128, kPatchLanesMax = kShortsMax * kShortLanes;
constexpr int kPatchRowsMax = kShortsMax, kEdgeRows = kPatchRowsMax + 2 * kShortLanes;
/// Powers for patches with an odd number of rows, whose middle is a row, and with an even number.
constexpr auto kRowPowers = [] {
  std::array<std::array<RowPowers, kPatchRowsMax + 1>, 2> powers{};
  for (const int even : {0, 1}) {
    for (int i = 0; i <= kPatchRowsMax; ++i) {
      const float y = static_cast<float>(i - kPatchRowsMax / 2) + 0.5F * static_cast<float>(even);
      powers[even][i] = {y, y * y, y * y * y};
    }
  }
  return powers;
}();
std::span<const RowPowers> powers_of_rows(int count) {
  return std::span(kRowPowers[count % 2 == 0]).subspan((kPatchRowsMax - count + 1) / 2, count);
}

inline __attribute__((always_inline)) void load(const std::int16_t* from, Shorts& to) {
  std::memcpy(&to, from, sizeof to);
}
inline __attribute__((always_inline)) void load(const std::uint8_t* from, Shorts& to) {
  using Bytes [[gnu::vector_size(kShortLanes)]] = std::uint8_t;
  Bytes bytes;
  std::memcpy(&bytes, from, sizeof bytes);
  to = reinterpret_cast<Shorts>(__builtin_shufflevector(bytes, Bytes{}, 0, 16, 1, 16, 2, 16, 3, 16, 4, 16, 5, 16, 6, 16,
                                                        7, 16, 8, 16, 9, 16, 10, 16, 11, 16, 12, 16, 13, 16, 14, 16, 15,
                                                        16));
}
inline __attribute__((always_inline)) std::int16_t least_of(const Shorts& lanes) {
  Shorts a = lanes, b = __builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7);
  a = a < b ? a : b;
  b = __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11);
  a = a < b ? a : b;
  b = __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13);
  a = a < b ? a : b;
  return a[0] < a[1] ? a[0] : a[1];
}
inline __attribute__((always_inline)) int total_of(const Shorts& lanes) {
  const auto wide = __builtin_convertvector(lanes, WideShorts);
  const IntLanes halves = __builtin_shufflevector(wide, wide, 0, 1, 2, 3, 4, 5, 6, 7) +
                          __builtin_shufflevector(wide, wide, 8, 9, 10, 11, 12, 13, 14, 15);
  const IntLanes quarters = halves + __builtin_shufflevector(halves, halves, 4, 5, 6, 7, 0, 1, 2, 3);
  const IntLanes eighths = quarters + __builtin_shufflevector(quarters, quarters, 2, 3, 0, 1, 6, 7, 4, 5);
  return eighths[0] + eighths[1];
}

/// Range of the pixels inside a patch, and the number of the others.
struct ShortRange {
  std::int16_t least, greatest;
  int outside;
};

struct ShortPatch {
  int left, top, width, height, margin;

  ShortPatch(const Region& region, int margin_px)
      : left(region.left - margin_px),
        top(region.top - margin_px),
        width(region.width_px() + 2 * margin_px),
        height(region.height_px() + 2 * margin_px),
        margin(margin_px) {}
  [[nodiscard]] int blocks() const { return (width + kShortLanes - 1) / kShortLanes; }
  [[nodiscard]] int lanes() const { return blocks() * height * kShortLanes; }
};

/// Starts and ends of a patch's rows, with padding that a register may reach.
struct ShortEdges {
  std::int16_t before[kEdgeRows], after[kEdgeRows];
};

/// Marks the edges of the region itself, shifted down by two margins.
inline __attribute__((always_inline)) void mark_edges(const ShortPatch& place, const Region& region, const Run* runs,
                                                      ShortEdges& edges) {
  const int reach = 2 * place.margin;
  const Shorts none_before = Shorts{} + std::numeric_limits<std::int16_t>::max(),
               none_after = Shorts{} + std::numeric_limits<std::int16_t>::min();
  for (int y = 0; y < place.height + reach; y += kShortLanes) {
    std::memcpy(edges.before + y, &none_before, sizeof none_before);
    std::memcpy(edges.after + y, &none_after, sizeof none_after);
  }
  for (const Run* run = runs; run < runs + region.run_count; ++run) {
    const int y = run->row - region.top + reach;
    const auto before = static_cast<std::int16_t>(run->left - region.left - 1);
    edges.before[y] = before < edges.before[y] ? before : edges.before[y];
    edges.after[y] = static_cast<std::int16_t>(run->right - region.left + reach);
  }
}

/// Widens the edges by the margin above and below, as follow_edge does.
inline __attribute__((always_inline)) void widen_edges(const ShortPatch& place, ShortEdges& edges) {
  const int reach = 2 * place.margin;
  for (int y = 0; y < place.height; y += kShortLanes) {
    Shorts least, greatest;
    load(edges.before + y, least), load(edges.after + y, greatest);
    for (int i = 1; i <= reach; ++i) {
      Shorts before, after;
      load(edges.before + y + i, before), load(edges.after + y + i, after);
      least = before < least ? before : least;
      greatest = after > greatest ? after : greatest;
    }
    std::memcpy(edges.before + y, &least, sizeof least);
    std::memcpy(edges.after + y, &greatest, sizeof greatest);
  }
}

/// Copies like copy_rows; pixels outside become 0.
inline __attribute__((always_inline)) void copy_shorts(const ImageView<std::uint8_t>& frame, const ShortPatch& place,
                                                       const ShortEdges& edges, std::int16_t* patch,
                                                       ShortRange& range) {
  constexpr Shorts kAt = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const int blocks = place.blocks();
  const Shorts most = Shorts{} + std::numeric_limits<std::int16_t>::max();
  Shorts least = most, greatest{};
  range.outside = blocks * kShortLanes * place.height;
  const std::uint8_t* row = frame.row(place.top) + place.left;
  for (int y = 0; y < place.height; ++y, row += frame.stride) {
    const Shorts after_first = Shorts{} + edges.before[y], before_last = Shorts{} + edges.after[y];
    range.outside -= edges.after[y] - edges.before[y] - 1;
    for (int block = 0; block < blocks; ++block, patch += kShortLanes) {
      const Shorts at = kAt + static_cast<std::int16_t>(block * kShortLanes);
      const Shorts inside = (at > after_first) & (at < before_last);
      Shorts value;
      load(row + static_cast<std::ptrdiff_t>(block) * kShortLanes, value);
      const Shorts here = inside ? value : most;
      value &= inside;
      std::memcpy(patch, &value, sizeof value);
      least = here < least ? here : least;
      greatest = value > greatest ? value : greatest;
    }
  }
  range.least = least_of(least);
  range.greatest = static_cast<std::int16_t>(-least_of(-greatest));
}

/// Finds levels like find_levels_of, in integers: pixels outside are zero, and count as dark.
inline __attribute__((always_inline)) void find_short_levels(const std::int16_t* patch, int count,
                                                             const ShortRange& range, PatchLevels& levels) {
  const auto least = static_cast<float>(range.least), greatest = static_cast<float>(range.greatest);
  const float quarter = 0.25F * (greatest - least);
  const Shorts above_low = Shorts{} + static_cast<std::int16_t>(least + quarter + 1),
               below_high = Shorts{} + static_cast<std::int16_t>(std::ceil(greatest - quarter) - 1);
  Shorts low_sum{}, high_sum{}, low_count{}, high_count{};  // negative counts
  for (int i = 0; i < count; i += kShortLanes) {
    Shorts value;
    load(patch + i, value);
    const Shorts is_low = value<above_low, is_high = value> below_high;
    low_sum += value & is_low;
    high_sum += value & is_high;
    low_count += is_low;
    high_count += is_high;
  }
  levels = {};
  const int lows = -total_of(low_count) - range.outside, highs = -total_of(high_count);
  if (lows == 0 || highs == 0) return;
  levels.background = static_cast<float>(total_of(low_sum)) / static_cast<float>(lows);
  levels.peak = static_cast<float>(total_of(high_sum)) / static_cast<float>(highs);
}

/// Works step by step on several regions at once: while one waits, the others proceed.
template <bool kSteady>
inline __attribute__((always_inline)) void weigh_regions_of(const ImageView<std::uint8_t>& frame, int margin_px,
                                                            std::span<WeighedRegion> regions) {
  ShortEdges edges[WeighedRegion::kAtOnce];
  std::int16_t patches[WeighedRegion::kAtOnce * kPatchLanesMax];
  for (std::size_t i = 0; i < regions.size(); ++i)
    mark_edges({*regions[i].region, margin_px}, *regions[i].region, regions[i].runs, edges[i]);
  std::int16_t* patch = patches;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const ShortPatch place(*regions[i].region, margin_px);
    ShortRange range;
    widen_edges(place, edges[i]);
    copy_shorts(frame, place, edges[i], patch, range);
    find_short_levels(patch, place.lanes(), range, regions[i].levels);
    patch += place.lanes();
  }
  patch = patches;
  for (WeighedRegion& weighed : regions) {
    const ShortPatch place(*weighed.region, margin_px);
    weighed.moments = {};
    if (weighed.levels.peak > weighed.levels.background) {
      sum_moments_of<std::int16_t, kSteady>(patch, place.blocks() * kShortLanes, place.width,
                                            powers_of_rows(place.height), 0.5F * static_cast<float>(place.width - 1),
                                            weighed.levels, weighed.moments);
    }
    patch += place.lanes();
  }
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

void sum_moments(const float* patch, int stride, std::span<const RowPowers> rows, float middle_x,
                 const PatchLevels& levels, RawMoments& moments) {
  Cloned<sum_moments_of<float, true>>::call(patch, stride, stride, rows, middle_x, levels, moments);
}

bool can_be_weighed(const ImageView<std::uint8_t>& frame, const Region& region, int margin_px) {
  const ShortPatch place(region, margin_px);
  const int right = place.left + place.blocks() * kShortLanes, bottom = place.top + place.height;
  if (place.left < 0 || place.top < 0 || right > frame.width || bottom > frame.height) return false;
  return place.lanes() <= kPatchLanesMax && 2 * margin_px <= kShortLanes;
}

void weigh_regions(const ImageView<std::uint8_t>& frame, int margin_px, SteadyCentre steady,
                   std::span<WeighedRegion> regions) {
  if (steady == SteadyCentre::kMeasured) {
    Cloned<weigh_regions_of<true>>::call(frame, margin_px, regions);
  } else {
    Cloned<weigh_regions_of<false>>::call(frame, margin_px, regions);
  }
}

}  // namespace slsd
