// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_patches.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

static_assert(kEight == kLanes);
using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;

/// Smallest standard deviation of a pixel, grey levels.
constexpr float kSigmaLeast = 1e-3F;

/// The order in which the unknowns are eliminated: the disparity last, because its variance is then the inverse of the
/// last pivot.
enum Unknown { kOffset, kGain, kGainX, kGainY, kAcross, kSlopeX, kSlopeY, kDisparity };

/// Inputs and results of one step for eight patches, one in each lane.
struct Eight {
  Lanes constant[3], x[3], y[3];  // coefficients of q, see PatchMap
  Lanes across_u, across_v, along_u, along_v;
  IntLanes origin_u, origin_v;  // origin of p, in samples
  Lanes gain, gain_x, gain_y, offset, noise;
  Lanes per_scale;               // scale of the residuals at which a pixel counts half; 0: all count fully
  Lanes censored, per_censored;  // range of the residuals of saturated pixels about zero, see Censored
  Lanes across, across_weight, gain_slope_weight;
  // Of cells: second derivatives of q, the square of the pattern that counts, and the window's part within the frame.
  Lanes xx[3], xy[3], yy[3];
  Lanes square_u, square_v, square_half;
  IntLanes left_px, right_px, top_px, bottom_px;  // relative to the centre, inclusive

  Lanes step[kFitted], left, weights, pixels, agreed, positive, scatter, variance, slope_variance;
  Lanes covariance[3][3];  // of disparity and slopes: the upper triangle
};

struct EightWindows {
  int side;
  std::ptrdiff_t stride;  // stride of the frame
  float full;
  const std::uint32_t* samples;
  int field_width, field_height;
  float slope_unit;
};

/// Values of a row's pixels, computed and summed step by step, so that each step's numbers stay in registers.
struct RowPixels {
  static constexpr int kMost = 32;
  Lanes level[kMost];
  BitLanes sample[kMost];              // the nearest sample of the field
  Lanes from_u[kMost], from_v[kMost];  // offset from that sample, in samples
  Lanes p[kMost], g[kMost], c[kMost];  // the pattern; its slopes along and across the epipolar line
  Lanes r[kMost], w[kMost];            // the residual and its weight
  Lanes inside[kMost];                 // of cells: the pixel's share within the square and the frame
  Lanes wg[kMost], wp[kMost];
};

/// Sums over adjacent pixels; letters in a name are factors as above, x is the column.
struct NinthSums {
  Lanes gg, gp, g, gr;
};
struct AlongSums {
  Lanes ggx, ggxx, gpx, gpxx, pp, ppx, ppxx, gx, p, px;
};
struct AcrossSums {
  Lanes gc, gcx, pc, pcx, c, cc, cr;
};
struct RestSums {
  Lanes w, grx, pr, prx, r, rr;
};
struct RowSums {
  NinthSums thirds[3];
  AlongSums along;
  AcrossSums across;
  RestSums rest;
};

/// Positions of a row's pixels, and their grey levels.
template <class T>
struct Row {
  const T* pixels[kLanes];  // in the middle column
  Lanes constant[3], x[3];  // of q
  Lanes gain;
  IntLanes within;  // all bits set if the row lies within the frame
};

inline __attribute__((always_inline)) void clamp_to(IntLanes& lanes, int last) {
  const IntLanes most = IntLanes{} + last, zero{};
  lanes = lanes < most ? lanes : most;
  lanes = lanes > zero ? lanes : zero;
}

/// The share of a pixel that counts: nothing outside the frame and the square, and less than all at the square's
/// border.
inline __attribute__((always_inline)) void find_inside(const Eight& e, const Lanes& u, const Lanes& v,
                                                       const IntLanes& within, Lanes& inside) {
  constexpr float kPerSample = 1.F / PatternField::kSamplesPerPx;
  const Lanes zero{}, one = zero + 1;
  const Lanes off_u = u * kPerSample - e.square_u, off_v = v * kPerSample - e.square_v;
  const Lanes far_u = off_u > zero ? off_u : -off_u, far_v = off_v > zero ? off_v : -off_v;
  inside = e.square_half - (far_u > far_v ? far_u : far_v);
  inside = inside < one ? inside : one;
  inside = (within & (inside > zero)) ? inside : zero;
}

/// Finds the positions of the pixels in the pattern.
template <bool kCells, class T>
inline __attribute__((always_inline)) void look_up(const Row<T>& row, int first, int count, const EightWindows& of,
                                                   const Eight& e, RowPixels& seen) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kFar = 4096;  // samples: an offset that keeps rounded numbers positive
  const Lanes one = Lanes{} + 1;
  for (int k = 0; k < count; ++k) {
    const auto x = static_cast<float>(first + k);
    IntLanes level, column = IntLanes{} + (first + k);
    [[maybe_unused]] IntLanes within{};
    if constexpr (kCells) {
      within = row.within & (column >= e.left_px) & (column <= e.right_px);
      column = column < e.left_px ? e.left_px : column > e.right_px ? e.right_px : column;
    }
    for (int lane = 0; lane < kLanes; ++lane) level[lane] = row.pixels[lane][column[lane]];
    seen.level[k] = __builtin_convertvector(level, Lanes);
    Lanes q[3];
    for (int i = 0; i < 3; ++i) q[i] = row.constant[i] + x * (kCells ? row.x[i] + 0.5F * x * e.xx[i] : e.x[i]);
    const Lanes per_q2 = one / q[2];
    const Lanes u = (q[0] * per_q2 + e.across_u) * kScale, v = (q[1] * per_q2 + e.across_v) * kScale;
    if constexpr (kCells) find_inside(e, u, v, within, seen.inside[k]);
    const IntLanes to_u = __builtin_convertvector(u + (kFar + 0.5F), IntLanes) - kFar,
                   to_v = __builtin_convertvector(v + (kFar + 0.5F), IntLanes) - kFar;
    seen.from_u[k] = u - __builtin_convertvector(to_u, Lanes);
    seen.from_v[k] = v - __builtin_convertvector(to_v, Lanes);
    IntLanes at_u = to_u + e.origin_u, at_v = to_v + e.origin_v;
    clamp_to(at_u, of.field_width - 1), clamp_to(at_v, of.field_height - 1);
    const IntLanes at = at_v * of.field_width + at_u;
    BitLanes sample;
    for (int lane = 0; lane < kLanes; ++lane) sample[lane] = of.samples[at[lane]];
    seen.sample[k] = sample;
  }
}

/// @param counted, agreed  numbers of pixels; the function adds to them
template <bool kCells, class T>
inline __attribute__((always_inline)) void compare(const Row<T>& row, int first, int count, const EightWindows& of,
                                                   const Eight& e, RowPixels& seen, Lanes& counted, Lanes& agreed) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  const Lanes zero{}, one = zero + 1;
  for (int k = 0; k < count; ++k) {
    const auto x = static_cast<float>(first + k);
    const BitLanes sample = seen.sample[k];
    const Lanes value = __builtin_convertvector(reinterpret_cast<IntLanes>(sample >> (2 * kBits)), Lanes);
    const Lanes slope_u =
        __builtin_convertvector(reinterpret_cast<IntLanes>(sample << (32 - 2 * kBits)) >> (32 - kBits), Lanes) *
        of.slope_unit;
    const Lanes slope_v =
        __builtin_convertvector(reinterpret_cast<IntLanes>(sample << (32 - kBits)) >> (32 - kBits), Lanes) *
        of.slope_unit;
    const Lanes p =
        value * PatternField::kValueUnit + (slope_u * seen.from_u[k] + slope_v * seen.from_v[k]) * (1 / kScale);
    const Lanes g = slope_u * e.along_u + slope_v * e.along_v, c = slope_v * e.along_u - slope_u * e.along_v;
    Lanes r = seen.level[k] - e.offset - p * (row.gain + x * e.gain_x);
    const IntLanes saturated = seen.level[k] >= of.full;
    Lanes above = r + e.censored;
    above = above > zero ? above : zero;
    Lanes knows = above * e.per_censored;
    knows = (saturated & (knows < one)) ? knows : one;
    r = (saturated & (0.5F * above > r)) ? 0.5F * above : r;
    const Lanes off = r * e.per_scale;
    const Lanes weight = one / (one + off * off);
    Lanes agrees = weight * weight;
    if constexpr (kCells) agrees *= seen.inside[k];
    const Lanes w = agrees * knows;
    seen.p[k] = p, seen.g[k] = g, seen.c[k] = c, seen.r[k] = r, seen.w[k] = w;
    seen.wg[k] = w * g, seen.wp[k] = w * p;
    if constexpr (kCells) counted += seen.inside[k];
    agreed += agrees;
  }
}

/// @param third_px  distance from the centre to the end of the middle third
inline __attribute__((always_inline)) void sum_up(const RowPixels& seen, int first, int count, int third_px,
                                                  RowSums& sums) {
  const int ends[4] = {0, std::clamp(-third_px - first, 0, count), std::clamp(third_px + 1 - first, 0, count), count};
  for (int third = 0; third < 3; ++third) {
    NinthSums sum{};
    for (int k = ends[third]; k < ends[third + 1]; ++k) {
      const Lanes& wg = seen.wg[k];
      sum.gg += wg * seen.g[k], sum.gp += wg * seen.p[k], sum.g += wg, sum.gr += wg * seen.r[k];
    }
    sums.thirds[third] = sum;
  }
  const Lanes start = Lanes{} + static_cast<float>(first);
  AlongSums along{};
  Lanes x = start;
  for (int k = 0; k < count; ++k, x += 1) {
    const Lanes &wp = seen.wp[k], &p = seen.p[k];
    const Lanes wgx = seen.wg[k] * x, wpx = wp * x, ggx = wgx * seen.g[k], gpx = wgx * p, ppx = wpx * p;
    along.ggx += ggx, along.ggxx += ggx * x, along.gpx += gpx, along.gpxx += gpx * x;
    along.pp += wp * p, along.ppx += ppx, along.ppxx += ppx * x;
    along.gx += wgx, along.p += wp, along.px += wpx;
  }
  sums.along = along;
  AcrossSums across{};
  x = start;
  for (int k = 0; k < count; ++k, x += 1) {
    const Lanes &c = seen.c[k], wc = seen.w[k] * c, gc = seen.wg[k] * c, pc = seen.wp[k] * c;
    across.gc += gc, across.gcx += gc * x, across.pc += pc, across.pcx += pc * x;
    across.c += wc, across.cc += wc * c, across.cr += wc * seen.r[k];
  }
  sums.across = across;
  RestSums rest{};
  x = start;
  for (int k = 0; k < count; ++k, x += 1) {
    const Lanes &r = seen.r[k], wr = seen.w[k] * r, pr = seen.wp[k] * r;
    rest.w += seen.w[k], rest.grx += seen.wg[k] * r * x, rest.pr += pr, rest.prx += pr * x;
    rest.r += wr, rest.rr += wr * r;
  }
  sums.rest = rest;
}

/// One step of Gauss and Newton. The right-hand side is the residual, so that no large numbers cancel.
template <bool kCells, class T>
inline __attribute__((always_inline)) void step_eight(const T* const* pixels, const EightWindows& of, Eight& e) {
  const Lanes zero{}, one = zero + 1;
  NinthSums ninths[3][3]{};
  Lanes normal[kFitted][kFitted], right[kFitted];
  for (int i = 0; i < kFitted; ++i) {
    right[i] = zero;
    for (Lanes& entry : normal[i]) entry = zero;
  }
  Lanes squares = zero, counted = zero, agreed = zero;
  const int half = of.side / 2, thirds = (of.side - 1) / 6;
  RowPixels seen;
  for (int down = -half; down <= half; ++down) {
    const auto y = static_cast<float>(down);
    Row<T> row;
    for (int k = 0; k < 3; ++k) {
      row.constant[k] = e.constant[k] + y * e.y[k];
      if constexpr (kCells) row.constant[k] += 0.5F * y * y * e.yy[k], row.x[k] = e.x[k] + y * e.xy[k];
    }
    row.gain = e.gain + y * e.gain_y;
    IntLanes at = IntLanes{} + down;
    if constexpr (kCells) {
      row.within = (at >= e.top_px) & (at <= e.bottom_px);
      at = at < e.top_px ? e.top_px : at > e.bottom_px ? e.bottom_px : at;
    }
    for (int lane = 0; lane < kLanes; ++lane) row.pixels[lane] = pixels[lane] + at[lane] * of.stride;
    for (int first = -half; first <= half; first += RowPixels::kMost) {
      const int count = std::min(RowPixels::kMost, half + 1 - first);
      look_up<kCells>(row, first, count, of, e, seen);
      compare<kCells>(row, first, count, of, e, seen, counted, agreed);
      RowSums sum;
      sum_up(seen, first, count, thirds, sum);
      NinthSums* const ninth = ninths[down < -thirds ? 0 : down > thirds ? 2 : 1];
      for (int third = 0; third < 3; ++third) {
        const NinthSums& part = sum.thirds[third];
        ninth[third].gg += part.gg, ninth[third].gp += part.gp;
        ninth[third].g += part.g, ninth[third].gr += part.gr;
      }
      const NinthSums &l = sum.thirds[0], &m = sum.thirds[1], &n = sum.thirds[2];
      const Lanes gg = l.gg + m.gg + n.gg, gp = l.gp + m.gp + n.gp, g = l.g + m.g + n.g, gr = l.gr + m.gr + n.gr;
      const auto& [ggx, ggxx, gpx, gpxx, pp, ppx, ppxx, gx, p, px] = sum.along;
      const auto& [gc, gcx, pc, pcx, c, cc, cr] = sum.across;
      const auto& [w, grx, pr, prx, r, rr] = sum.rest;
      const float yy = y * y;
      normal[kDisparity][kDisparity] += gg, normal[kDisparity][kSlopeX] += ggx;
      normal[kDisparity][kSlopeY] += y * gg, normal[kSlopeX][kSlopeX] += ggxx;
      normal[kSlopeY][kSlopeX] += y * ggx, normal[kSlopeY][kSlopeY] += yy * gg;
      normal[kDisparity][kGain] += gp, normal[kDisparity][kGainX] += gpx, normal[kDisparity][kGainY] += y * gp;
      normal[kSlopeX][kGainX] += gpxx, normal[kSlopeX][kGainY] += y * gpx;
      normal[kSlopeY][kGainY] += yy * gp;
      normal[kGain][kGain] += pp, normal[kGainX][kGain] += ppx, normal[kGainY][kGain] += y * pp;
      normal[kGainX][kGainX] += ppxx, normal[kGainY][kGainX] += y * ppx;
      normal[kGainY][kGainY] += yy * pp;
      normal[kDisparity][kOffset] += g, normal[kSlopeX][kOffset] += gx, normal[kSlopeY][kOffset] += y * g;
      normal[kGain][kOffset] += p, normal[kGainX][kOffset] += px, normal[kGainY][kOffset] += y * p;
      normal[kDisparity][kAcross] += gc, normal[kSlopeX][kAcross] += gcx, normal[kSlopeY][kAcross] += y * gc;
      normal[kAcross][kGain] += pc, normal[kAcross][kGainX] += pcx, normal[kAcross][kGainY] += y * pc;
      normal[kAcross][kAcross] += cc, normal[kAcross][kOffset] += c, normal[kOffset][kOffset] += w;
      right[kDisparity] += gr, right[kSlopeX] += grx, right[kSlopeY] += y * gr;
      right[kGain] += pr, right[kGainX] += prx, right[kGainY] += y * pr;
      right[kAcross] += cr, right[kOffset] += r;
      squares += rr;
    }
  }
  normal[kSlopeX][kGain] = normal[kDisparity][kGainX], normal[kSlopeY][kGain] = normal[kDisparity][kGainY];
  normal[kSlopeY][kGainX] = normal[kSlopeX][kGainY];
  e.weights = normal[kOffset][kOffset], e.agreed = agreed;
  e.pixels = kCells ? counted : zero + static_cast<float>(of.side * of.side);

  // Prior knowledge, see AlignPriors.
  normal[kAcross][kAcross] += e.across_weight, right[kAcross] -= e.across_weight * e.gain * e.across;
  normal[kGainX][kGainX] += e.gain_slope_weight, right[kGainX] -= e.gain_slope_weight * e.gain_x;
  normal[kGainY][kGainY] += e.gain_slope_weight, right[kGainY] -= e.gain_slope_weight * e.gain_y;

  // normal = L D L^T; the lower triangle becomes L, forward[] L^-1 right.
  Lanes per_pivot[kFitted], forward[kFitted];
  e.positive = one;
  for (int j = 0; j < kFitted; ++j) {
    e.positive = normal[j][j] > 1e-9F ? e.positive : zero;
    per_pivot[j] = one / normal[j][j];
    for (int i = j + 1; i < kFitted; ++i) {
      const Lanes factor = normal[i][j] * per_pivot[j];
      for (int k = j + 1; k <= i; ++k) normal[i][k] -= factor * normal[k][j];
    }
    for (int i = j + 1; i < kFitted; ++i) normal[i][j] *= per_pivot[j];
  }
  Lanes taken = zero;
  for (int i = 0; i < kFitted; ++i) {
    forward[i] = right[i];
    for (int k = 0; k < i; ++k) forward[i] -= normal[i][k] * forward[k];
    taken += forward[i] * forward[i] * per_pivot[i];
  }
  for (int i = kFitted - 1; i >= 0; --i) {
    e.step[i] = forward[i] * per_pivot[i];
    for (int k = i + 1; k < kFitted; ++k) e.step[i] -= normal[k][i] * e.step[k];
  }
  const Lanes left = squares - taken;
  e.left = left > zero ? left : zero;
  const Lanes& l65 = normal[kSlopeY][kSlopeX];
  const Lanes& l76 = normal[kDisparity][kSlopeY];
  const Lanes l75 = normal[kDisparity][kSlopeX] - l76 * l65;
  const Lanes &of_x = per_pivot[kSlopeX], &of_y = per_pivot[kSlopeY];
  e.variance = per_pivot[kDisparity];
  const Lanes variance_x = of_x + l65 * l65 * of_y + l75 * l75 * e.variance, variance_y = of_y + l76 * l76 * e.variance;
  e.slope_variance = 0.5F * (variance_x + variance_y);
  if constexpr (kCells) {
    e.covariance[0][0] = e.variance, e.covariance[1][1] = variance_x, e.covariance[2][2] = variance_y;
    e.covariance[0][1] = l75 * -e.variance, e.covariance[0][2] = l76 * -e.variance;
    e.covariance[1][2] = l76 * l75 * e.variance - l65 * of_y;
  }

  // The disparities of the ninths after the step, beyond noise.
  const auto away = static_cast<float>((half + thirds + 1) / 2);
  Lanes of_ninths = zero, weight = zero, expected = zero;
  const Lanes noise = e.left / e.weights;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const float x = static_cast<float>(column - 1) * away, y = static_cast<float>(row - 1) * away;
      const NinthSums& ninth = ninths[row][column];
      const Lanes& gg = ninth.gg;
      const Lanes gr = ninth.gr - gg * (e.step[kDisparity] + x * e.step[kSlopeX] + y * e.step[kSlopeY]) -
                       ninth.gp * (e.step[kGain] + x * e.step[kGainX] + y * e.step[kGainY]) - ninth.g * e.step[kOffset];
      const Lanes any = gg > zero ? one : zero;
      of_ninths += any * gr * gr / (gg + 1e-20F), expected += any * noise, weight += gg;
    }
  }
  const Lanes beyond = of_ninths - expected;
  e.scatter = (beyond > zero ? beyond : zero) / (weight + 1e-20F);
}

template <class T>
using Centres = const T* const*;

inline __attribute__((always_inline)) void step_of_bytes(Centres<std::uint8_t> centres, const EightWindows& of,
                                                         Eight& eight) {
  step_eight<false>(centres, of, eight);
}
inline __attribute__((always_inline)) void step_of_words(Centres<std::uint16_t> centres, const EightWindows& of,
                                                         Eight& eight) {
  step_eight<false>(centres, of, eight);
}
inline __attribute__((always_inline)) void cell_step_of_bytes(Centres<std::uint8_t> centres, const EightWindows& of,
                                                              Eight& eight) {
  step_eight<true>(centres, of, eight);
}
inline __attribute__((always_inline)) void cell_step_of_words(Centres<std::uint16_t> centres, const EightWindows& of,
                                                              Eight& eight) {
  step_eight<true>(centres, of, eight);
}
template <bool kCells>
void call_step(Centres<std::uint8_t> centres, const EightWindows& of, Eight& eight) {
  if constexpr (kCells) {
    Cloned<cell_step_of_bytes>::call(centres, of, eight);
  } else {
    Cloned<step_of_bytes>::call(centres, of, eight);
  }
}
template <bool kCells>
void call_step(Centres<std::uint16_t> centres, const EightWindows& of, Eight& eight) {
  if constexpr (kCells) {
    Cloned<cell_step_of_words>::call(centres, of, eight);
  } else {
    Cloned<step_of_words>::call(centres, of, eight);
  }
}

/// Estimates the mean of a window from its diagonals.
template <class T>
float level_of(const ImageView<T>& frame, const PatchTask& task, int half) {
  float sum = 0;
  for (int i = -half; i <= half; ++i)
    sum += static_cast<float>(frame.at(task.x + i, task.y + i)) + static_cast<float>(frame.at(task.x - i, task.y + i));
  return sum / static_cast<float>(4 * half + 2);
}

void put(Eight& e, int lane, const PatchTask& task, const AlignOptions& options) {
  const PatchMap& map = task.map;
  const PatchState& state = task.state;
  for (int k = 0; k < 3; ++k) {
    e.constant[k][lane] = map.base(k, 2) + map.shift[k] * state.disparity;
    e.x[k][lane] = map.base(k, 0) + map.shift[k] * state.slope_x;
    e.y[k][lane] = map.base(k, 1) + map.shift[k] * state.slope_y;
  }
  e.across_u[lane] = -state.across * map.along.y(), e.across_v[lane] = state.across * map.along.x();
  e.along_u[lane] = map.along.x(), e.along_v[lane] = map.along.y();
  e.origin_u[lane] = (map.origin_px.x() + PatternField::kBorderPx) * PatternField::kSamplesPerPx;
  e.origin_v[lane] = (map.origin_px.y() + PatternField::kBorderPx) * PatternField::kSamplesPerPx;
  e.gain[lane] = state.gain, e.gain_x[lane] = state.gain_x, e.gain_y[lane] = state.gain_y;
  e.offset[lane] = state.offset, e.noise[lane] = task.noise, e.across[lane] = state.across;
  const float squares = task.noise * task.noise + options.misfit_share * options.misfit_share * state.gain * state.gain;
  const float sigma = std::max(kSigmaLeast, std::sqrt(squares));
  e.per_scale[lane] = state.gain > 0 ? 1 / (options.outlier_sigmas * sigma) : 0;
  // Without a gain, a saturated pixel tells nothing.
  e.censored[lane] = state.gain > 0 ? kCensoredSigmas * sigma : std::numeric_limits<float>::lowest();
  e.per_censored[lane] = 0.5F / e.censored[lane];
  const AlignPriors priors = align_priors(options, task.noise, state.gain);
  e.across_weight[lane] = priors.across, e.gain_slope_weight[lane] = priors.gain_slope;
}

void take(const Eight& e, int lane, PatchTask& task) {
  task.pixels = e.pixels[lane];
  task.support = e.agreed[lane] / std::max(1.F, task.pixels);
  PatchState& state = task.state;
  const float gain = state.gain + e.step[kGain][lane];
  bool finite = true;
  for (const Lanes& step : e.step) finite = finite && std::isfinite(step[lane]);
  task.failed = !(e.weights[lane] > 2 * kFitted) || !(e.positive[lane] > 0) || !finite || !(gain > task.noise);
  if (task.failed) return;
  state.gain = gain, state.offset += e.step[kOffset][lane];
  state.gain_x += e.step[kGainX][lane], state.gain_y += e.step[kGainY][lane];
  const auto moved = [&](Unknown k) { return std::clamp(e.step[k][lane] / gain, -1.F, 1.F); };
  task.moved = moved(kDisparity);
  state.disparity += task.moved, state.slope_x += moved(kSlopeX), state.slope_y += moved(kSlopeY);
  state.across += moved(kAcross);
  task.residual = std::sqrt(e.left[lane] / e.weights[lane]);
  task.scatter = std::sqrt(e.scatter[lane]) / gain;
  task.variance = e.variance[lane] / (gain * gain), task.slope_variance = e.slope_variance[lane] / (gain * gain);
}

void take_covariance(const Eight& e, int lane, CellTask& task) {
  const float per_gain = 1 / task.patch.state.gain;
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column)
      task.covariance(row, column) = task.covariance(column, row) =
          e.covariance[row][column][lane] * per_gain * per_gain;
}

EightWindows windows_of(std::ptrdiff_t stride, double full, const PatternField& field, int window_px) {
  return {window_px,     stride,         static_cast<float>(full), field.samples(),
          field.width(), field.height(), field.slope_unit()};
}

template <class T>
void align(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
           int window_px, std::span<PatchTask* const> tasks) {
  Eight eight;
  const T* centres[kEight];
  for (int lane = 0; lane < kEight; ++lane) {
    // Unused lanes repeat the first one.
    PatchTask& task = *tasks[static_cast<std::size_t>(lane) < tasks.size() ? lane : 0];
    if (!(task.state.gain > 0)) task.state.offset = level_of(frame, task, window_px / 2);
    centres[lane] = frame.row(task.y) + task.x;
    put(eight, lane, task, options);
  }
  call_step<false>(centres, windows_of(frame.stride, full, field, window_px), eight);
  for (std::size_t lane = 0; lane < tasks.size(); ++lane) take(eight, static_cast<int>(lane), *tasks[lane]);
}

/// Adds the properties that only cells have.
template <class T>
void put_cell(Eight& e, int lane, const ImageView<T>& frame, const CellTask& task) {
  const PatchMap& map = task.patch.map;
  const PatchState& state = task.patch.state;
  for (int k = 0; k < 3; ++k) {
    e.xx[k][lane] = map.shift[k] * state.bend_xx;
    e.xy[k][lane] = map.shift[k] * state.bend_xy;
    e.yy[k][lane] = map.shift[k] * state.bend_yy;
  }
  const Eigen::Vector2f square = task.square_middle_px - map.origin_px.cast<float>();
  e.square_u[lane] = square.x(), e.square_v[lane] = square.y(), e.square_half[lane] = task.square_half_px;
  e.left_px[lane] = -task.patch.x, e.right_px[lane] = frame.width - 1 - task.patch.x;
  e.top_px[lane] = -task.patch.y, e.bottom_px[lane] = frame.height - 1 - task.patch.y;
}

/// Aligns up to eight cells in all steps. The largest window serves all.
template <class T>
void align_some(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
                std::span<CellTask> tasks) {
  Eight eight;
  const T* centres[kEight];
  const int window_px = std::ranges::max(tasks, {}, &CellTask::window_px).window_px;
  const EightWindows windows = windows_of(frame.stride, full, field, window_px);
  for (int step = 0; step < options.steps; ++step) {
    for (int lane = 0; lane < kEight; ++lane) {
      CellTask& task = tasks[static_cast<std::size_t>(lane) < tasks.size() ? lane : 0];
      centres[lane] = frame.row(task.patch.y) + task.patch.x;
      if (!(task.patch.state.gain > 0)) task.patch.state.offset = static_cast<float>(*centres[lane]);
      put(eight, lane, task.patch, options);
      put_cell(eight, lane, frame, task);
    }
    call_step<true>(centres, windows, eight);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      if (tasks[i].patch.failed) continue;
      const auto lane = static_cast<int>(i);
      take(eight, lane, tasks[i].patch);
      if (!tasks[i].patch.failed) take_covariance(eight, lane, tasks[i]);
    }
  }
}

}  // namespace

void align_eight(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 int window_px, std::span<PatchTask* const> tasks) {
  std::visit([&](const auto& pixels) { align(pixels, full, field, options, window_px, tasks); }, frame);
}

void align_cells(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 std::span<CellTask> tasks) {
  for (CellTask& task : tasks) task.patch.failed = false;
  for (std::size_t first = 0; first < tasks.size(); first += kEight) {
    const auto some = tasks.subspan(first, std::min<std::size_t>(kEight, tasks.size() - first));
    std::visit([&](const auto& pixels) { align_some(pixels, full, field, options, some); }, frame);
  }
}

}  // namespace slsd
