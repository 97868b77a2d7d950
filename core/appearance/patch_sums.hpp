// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/appearance/patch_equations.hpp"
#include "core/appearance/patch_task.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/lanes.hpp"

namespace slsd {

using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;

/// Kinds of patches: a window within the frame; a square of the pattern, see CellTask; a part of a window.
enum class PatchShape : std::uint8_t { kWindow, kCell, kBlock };

/// Eight patches, one in each lane, and the present parameters.
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
};

/// The frame and the pattern's field, for all lanes.
struct FrameAndField {
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

/// Smallest standard deviation of a pixel, grey levels.
inline constexpr float kSigmaLeast = 1e-3F;

/// Finds the scales of the residuals and the weights of the priors, from gain and noise.
inline __attribute__((always_inline)) void find_scales(const AlignOptions& options, Eight& e) {
  const Lanes zero{}, one = zero + 1;
  Lanes sigma = e.noise * e.noise + options.misfit_share * options.misfit_share * e.gain * e.gain;
  for (int lane = 0; lane < kLanes; ++lane) sigma[lane] = std::max(kSigmaLeast, std::sqrt(sigma[lane]));
  const IntLanes known = e.gain > zero;
  e.per_scale = known ? one / (options.outlier_sigmas * sigma) : zero;
  // Without a gain, a saturated pixel tells nothing.
  e.censored = known ? kCensoredSigmas * sigma : zero + std::numeric_limits<float>::lowest();
  e.per_censored = 0.5F / e.censored;
  const AlignPriors<Lanes> priors = align_priors(options, e.noise, e.gain);
  e.across_weight = priors.across, e.gain_slope_weight = priors.gain_slope;
}

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
template <PatchShape kShape, class T>
inline __attribute__((always_inline)) void look_up(const Row<T>& row, int first, int count, const FrameAndField& of,
                                                   const Eight& e, RowPixels& seen) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kFar = 4096;  // samples: an offset that keeps rounded numbers positive
  const Lanes one = Lanes{} + 1;
  for (int k = 0; k < count; ++k) {
    const auto x = static_cast<float>(first + k);
    IntLanes level, column = IntLanes{} + (first + k);
    [[maybe_unused]] IntLanes within{};
    if constexpr (kShape == PatchShape::kCell) {
      within = row.within & (column >= e.left_px) & (column <= e.right_px);
      column = column < e.left_px ? e.left_px : column > e.right_px ? e.right_px : column;
    }
    for (int lane = 0; lane < kLanes; ++lane) level[lane] = row.pixels[lane][column[lane]];
    seen.level[k] = __builtin_convertvector(level, Lanes);
    Lanes q[3];
    for (int i = 0; i < 3; ++i)
      q[i] = row.constant[i] + x * (kShape == PatchShape::kCell ? row.x[i] + 0.5F * x * e.xx[i] : e.x[i]);
    const Lanes per_q2 = one / q[2];
    const Lanes u = (q[0] * per_q2 + e.across_u) * kScale, v = (q[1] * per_q2 + e.across_v) * kScale;
    if constexpr (kShape == PatchShape::kCell) find_inside(e, u, v, within, seen.inside[k]);
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
template <PatchShape kShape, class T>
inline __attribute__((always_inline)) void compare(const Row<T>& row, int first, int count, const FrameAndField& of,
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
    if constexpr (kShape == PatchShape::kCell) agrees *= seen.inside[k];
    const Lanes w = agrees * knows;
    seen.p[k] = p, seen.g[k] = g, seen.c[k] = c, seen.r[k] = r, seen.w[k] = w;
    seen.wg[k] = w * g, seen.wp[k] = w * p;
    if constexpr (kShape == PatchShape::kCell) counted += seen.inside[k];
    agreed += agrees;
  }
}

/// @param third_px  distance from the centre to the end of the middle third; of windows and cells
template <PatchShape kShape>
inline __attribute__((always_inline)) void sum_up(const RowPixels& seen, int first, int count, int third_px,
                                                  RowSums& sums) {
  constexpr int kThirds = kShape == PatchShape::kBlock ? 1 : 3;
  int ends[kThirds + 1] = {};
  ends[kThirds] = count;
  if constexpr (kThirds == 3)
    ends[1] = std::clamp(-third_px - first, 0, count), ends[2] = std::clamp(third_px + 1 - first, 0, count);
  for (int third = 0; third < kThirds; ++third) {
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

/// Pixels of a row or column: those before `end`.
struct PixelRange {
  int first, end;
};

/// Adds the pixels of a window or block to its sums.
/// @param pixels   each lane's centre
/// @param x_px, y_px  ranges relative to the centre
/// @param ninths   sums of the ninths of a window; null for a block
/// @param counted  number of a cell's pixels
template <PatchShape kShape, class T>
inline __attribute__((always_inline)) void add_pixels(const T* const* pixels, const FrameAndField& of, const Eight& e,
                                                      const PixelRange& x_px, const PixelRange& y_px, Lanes* sums,
                                                      NinthSums (*ninths)[3], Lanes& counted) {
  const auto add = [&](PatchSum which, const Lanes& more) __attribute__((always_inline)) {
    sums[static_cast<int>(which)] += more;
  };
  using enum PatchSum;
  const int thirds = (y_px.end - y_px.first - 1) / 6;
  RowPixels seen;
  for (int down = y_px.first; down < y_px.end; ++down) {
    const auto y = static_cast<float>(down);
    Row<T> row;
    for (int k = 0; k < 3; ++k) {
      row.constant[k] = e.constant[k] + y * e.y[k];
      if constexpr (kShape == PatchShape::kCell)
        row.constant[k] += 0.5F * y * y * e.yy[k], row.x[k] = e.x[k] + y * e.xy[k];
    }
    row.gain = e.gain + y * e.gain_y;
    IntLanes at = IntLanes{} + down;
    if constexpr (kShape == PatchShape::kCell) {
      row.within = (at >= e.top_px) & (at <= e.bottom_px);
      at = at < e.top_px ? e.top_px : at > e.bottom_px ? e.bottom_px : at;
    }
    for (int lane = 0; lane < kLanes; ++lane) row.pixels[lane] = pixels[lane] + at[lane] * of.stride;
    for (int left = x_px.first; left < x_px.end; left += RowPixels::kMost) {
      const int count = std::min(RowPixels::kMost, x_px.end - left);
      look_up<kShape>(row, left, count, of, e, seen);
      compare<kShape>(row, left, count, of, e, seen, counted, sums[static_cast<int>(kAgreed)]);
      RowSums sum;
      sum_up<kShape>(seen, left, count, thirds, sum);
      NinthSums all = sum.thirds[0];
      if constexpr (kShape != PatchShape::kBlock) {
        NinthSums* const ninth = ninths[down < -thirds ? 0 : down > thirds ? 2 : 1];
        for (int third = 0; third < 3; ++third) {
          const NinthSums& part = sum.thirds[third];
          ninth[third].gg += part.gg, ninth[third].gp += part.gp;
          ninth[third].g += part.g, ninth[third].gr += part.gr;
        }
        const NinthSums &m = sum.thirds[1], &n = sum.thirds[2];
        all.gg += m.gg + n.gg, all.gp += m.gp + n.gp, all.g += m.g + n.g, all.gr += m.gr + n.gr;
      }
      const auto& [gg, gp, g, gr] = all;
      const auto& [ggx, ggxx, gpx, gpxx, pp, ppx, ppxx, gx, p, px] = sum.along;
      const auto& [gc, gcx, pc, pcx, c, cc, cr] = sum.across;
      const auto& [w, grx, pr, prx, r, rr] = sum.rest;
      const float yy = y * y;
      add(kGG, gg), add(kGGx, ggx), add(kGGy, y * gg), add(kGGxx, ggxx), add(kGGxy, y * ggx), add(kGGyy, yy * gg);
      add(kGP, gp), add(kGPx, gpx), add(kGPy, y * gp), add(kGPxx, gpxx), add(kGPxy, y * gpx), add(kGPyy, yy * gp);
      add(kPP, pp), add(kPPx, ppx), add(kPPy, y * pp), add(kPPxx, ppxx), add(kPPxy, y * ppx), add(kPPyy, yy * pp);
      add(kG, g), add(kGx, gx), add(kGy, y * g), add(kP, p), add(kPx, px), add(kPy, y * p);
      add(kGC, gc), add(kGCx, gcx), add(kGCy, y * gc), add(kPC, pc), add(kPCx, pcx), add(kPCy, y * pc);
      add(kC, c), add(kCC, cc), add(kOne, w);
      add(kGR, gr), add(kGRx, grx), add(kGRy, y * gr), add(kPR, pr), add(kPRx, prx), add(kPRy, y * pr);
      add(kCR, cr), add(kR, r), add(kRR, rr);
    }
  }
}

/// The scatter of the ninths of a window about the plane, after a step, beyond noise. In squares of gain times px.
/// @param away     distance of the outer ninths' centres from the middle, px
/// @param weights  sum of all pixels' weights
inline __attribute__((always_inline)) void find_scatter(const NinthSums (*ninths)[3], float away, const Lanes& weights,
                                                        const EightEquations& of, Lanes& scatter) {
  using enum Fitted::Unknown;
  const Lanes zero{}, one = zero + 1;
  Lanes of_ninths = zero, weight = zero, expected = zero;
  const Lanes noise = of.left / weights;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const float x = static_cast<float>(column - 1) * away, y = static_cast<float>(row - 1) * away;
      const NinthSums& ninth = ninths[row][column];
      const Lanes& gg = ninth.gg;
      const Lanes gr = ninth.gr - gg * (of.step[kDisparity] + x * of.step[kSlopeX] + y * of.step[kSlopeY]) -
                       ninth.gp * (of.step[kGain] + x * of.step[kGainX] + y * of.step[kGainY]) -
                       ninth.g * of.step[kOffset];
      const Lanes any = gg > zero ? one : zero;
      of_ninths += any * gr * gr / (gg + 1e-20F), expected += any * noise, weight += gg;
    }
  }
  const Lanes beyond = of_ninths - expected;
  scatter = (beyond > zero ? beyond : zero) / (weight + 1e-20F);
}

/// Adds prior knowledge to the equations, see AlignPriors.
inline __attribute__((always_inline)) void add_priors(const Eight& e, EightEquations& to) {
  using enum Fitted::Unknown;
  to.normal[kAcross][kAcross] += e.across_weight, to.right[kAcross] -= e.across_weight * e.gain * e.across;
  to.normal[kGainX][kGainX] += e.gain_slope_weight, to.right[kGainX] -= e.gain_slope_weight * e.gain_x;
  to.normal[kGainY][kGainY] += e.gain_slope_weight, to.right[kGainY] -= e.gain_slope_weight * e.gain_y;
}

}  // namespace slsd
