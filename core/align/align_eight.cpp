// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/align/align_eight.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

static_assert(kEight == kLanes);
using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;

/// The order in which the unknowns are eliminated: the disparity last, as its variance is then the last pivot's
/// inverse.
enum Unknown { kOffset, kGain, kGainX, kGainY, kAcross, kSlopeX, kSlopeY, kDisparity };

/// What is known of eight patches, and what a step finds: a patch to each lane.
struct Eight {
  Lanes constant[3], x[3], y[3];  // of q, see PatchMap
  Lanes across_u, across_v, along_u, along_v;
  IntLanes origin_u, origin_v;  // of p, in samples
  Lanes gain, gain_x, gain_y, offset, noise;
  Lanes per_scale;  // of residuals that count half; 0: all count
  Lanes across, across_weight, gain_slope_weight;

  Lanes step[kFitted], left, weights, pixels, positive, scatter, variance, slope_variance;
};

struct EightWindows {
  int side;
  std::ptrdiff_t stride;  // of the frame
  float full;
  const std::uint32_t* samples;
  int field_width, field_height;
  float slope_unit;
};

/// Of a row; those of g and the residual by the window's thirds, for the ninths.
enum RowSum {
  kGG,      // by thirds
  kGR = 3,  // by thirds
  kGP = 6,  // by thirds
  kG = 9,   // by thirds
  kGGX = 12,
  kGGXX,
  kGPX,
  kGPXX,
  kPP,
  kPPX,
  kPPXX,
  kGX,
  kP,
  kPX,
  kGC,
  kGCX,
  kPC,
  kPCX,
  kGRX,
  kPR,
  kPRX,
  kW,
  kC,
  kCC,
  kCR,
  kR,
  kRR,
  kPixels,
  kRowSums
};

inline __attribute__((always_inline)) void clamp_to(IntLanes& lanes, int last) {
  const IntLanes most = IntLanes{} + last, zero{};
  lanes = lanes < most ? lanes : most;
  lanes = lanes > zero ? lanes : zero;
}

/// One step of Gauss and Newton, with what the model leaves as the right side, so that nothing large cancels.
template <class T>
inline __attribute__((always_inline)) void step_eight(const T* const* pixels, const EightWindows& of, Eight& e) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  constexpr int kFar = 4096;  // samples: keeps what is rounded positive
  const Lanes zero{}, one = zero + 1;
  Lanes ninths[3][12];
  for (auto& row : ninths)
    for (Lanes& sum : row) sum = zero;
  Lanes normal[kFitted][kFitted], right[kFitted];
  for (int i = 0; i < kFitted; ++i) {
    right[i] = zero;
    for (Lanes& entry : normal[i]) entry = zero;
  }
  Lanes squares = zero, counted_pixels = zero;
  const int half = of.side / 2, thirds = (of.side - 1) / 6;
  for (int row = -half; row <= half; ++row) {
    const auto y = static_cast<float>(row);
    Lanes constant[3];
    for (int k = 0; k < 3; ++k) constant[k] = e.constant[k] + y * e.y[k];
    const Lanes gain = e.gain + y * e.gain_y;
    Lanes sum[kRowSums];
    for (Lanes& part : sum) part = zero;
    const T* at_pixel[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) at_pixel[lane] = pixels[lane] + row * of.stride;
    for (int column = -half; column <= half; ++column) {
      const auto x = static_cast<float>(column);
      const int third = column < -thirds ? 0 : column > thirds ? 2 : 1;
      IntLanes level;
      for (int lane = 0; lane < kLanes; ++lane) level[lane] = at_pixel[lane][column];
      const Lanes i = __builtin_convertvector(level, Lanes);
      const Lanes counted = i < of.full ? one : zero;
      const Lanes per_q2 = one / (constant[2] + x * e.x[2]);
      const Lanes u = ((constant[0] + x * e.x[0]) * per_q2 + e.across_u) * kScale,
                  v = ((constant[1] + x * e.x[1]) * per_q2 + e.across_v) * kScale;
      // The nearest sample.
      const IntLanes to_u = __builtin_convertvector(u + (kFar + 0.5F), IntLanes) - kFar,
                     to_v = __builtin_convertvector(v + (kFar + 0.5F), IntLanes) - kFar;
      const Lanes from_u = u - __builtin_convertvector(to_u, Lanes), from_v = v - __builtin_convertvector(to_v, Lanes);
      IntLanes at_u = to_u + e.origin_u, at_v = to_v + e.origin_v;
      clamp_to(at_u, of.field_width - 1), clamp_to(at_v, of.field_height - 1);
      const IntLanes at = at_v * of.field_width + at_u;
      BitLanes bits;
      for (int lane = 0; lane < kLanes; ++lane) bits[lane] = of.samples[at[lane]];
      const Lanes value = __builtin_convertvector(reinterpret_cast<IntLanes>(bits >> (2 * kBits)), Lanes);
      const Lanes slope_u =
          __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - 2 * kBits)) >> (32 - kBits), Lanes) *
          of.slope_unit;
      const Lanes slope_v =
          __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - kBits)) >> (32 - kBits), Lanes) *
          of.slope_unit;
      const Lanes p = value * PatternField::kValueUnit + (slope_u * from_u + slope_v * from_v) * (1 / kScale);
      const Lanes g = slope_u * e.along_u + slope_v * e.along_v, c = slope_v * e.along_u - slope_u * e.along_v;
      const Lanes r = i - e.offset - p * (gain + x * e.gain_x);
      const Lanes off = r * e.per_scale;
      const Lanes weight = one / (one + off * off);
      const Lanes w = counted * weight * weight;
      const Lanes wg = w * g, wp = w * p, wc = w * c, wr = w * r;
      const Lanes gg = wg * g, gp = wg * p, pp = wp * p, gr = wg * r, pr = wp * r, gc = wg * c, pc = wp * c;
      const Lanes ggx = gg * x, gpx = gp * x, ppx = pp * x;
      sum[kGG + third] += gg, sum[kGR + third] += gr, sum[kGP + third] += gp, sum[kG + third] += wg;
      sum[kGGX] += ggx, sum[kGGXX] += ggx * x;
      sum[kGPX] += gpx, sum[kGPXX] += gpx * x;
      sum[kPP] += pp, sum[kPPX] += ppx, sum[kPPXX] += ppx * x;
      sum[kGX] += wg * x, sum[kP] += wp, sum[kPX] += wp * x;
      sum[kGC] += gc, sum[kGCX] += gc * x, sum[kPC] += pc, sum[kPCX] += pc * x;
      sum[kGRX] += gr * x, sum[kPR] += pr, sum[kPRX] += pr * x;
      sum[kW] += w, sum[kC] += wc, sum[kCC] += wc * c, sum[kCR] += wc * r;
      sum[kR] += wr, sum[kRR] += wr * r, sum[kPixels] += counted;
    }
    Lanes* const ninth = ninths[row < -thirds ? 0 : row > thirds ? 2 : 1];
    for (int k = 0; k < 12; ++k) ninth[k] += sum[k];
    const Lanes gg = sum[kGG] + sum[kGG + 1] + sum[kGG + 2], gr = sum[kGR] + sum[kGR + 1] + sum[kGR + 2];
    const Lanes gp = sum[kGP] + sum[kGP + 1] + sum[kGP + 2], g = sum[kG] + sum[kG + 1] + sum[kG + 2];
    const float yy = y * y;
    normal[kDisparity][kDisparity] += gg, normal[kDisparity][kSlopeX] += sum[kGGX];
    normal[kDisparity][kSlopeY] += y * gg, normal[kSlopeX][kSlopeX] += sum[kGGXX];
    normal[kSlopeY][kSlopeX] += y * sum[kGGX], normal[kSlopeY][kSlopeY] += yy * gg;
    normal[kDisparity][kGain] += gp, normal[kDisparity][kGainX] += sum[kGPX], normal[kDisparity][kGainY] += y * gp;
    normal[kSlopeX][kGainX] += sum[kGPXX], normal[kSlopeX][kGainY] += y * sum[kGPX];
    normal[kSlopeY][kGainY] += yy * gp;
    normal[kGain][kGain] += sum[kPP], normal[kGainX][kGain] += sum[kPPX], normal[kGainY][kGain] += y * sum[kPP];
    normal[kGainX][kGainX] += sum[kPPXX], normal[kGainY][kGainX] += y * sum[kPPX];
    normal[kGainY][kGainY] += yy * sum[kPP];
    normal[kDisparity][kOffset] += g, normal[kSlopeX][kOffset] += sum[kGX], normal[kSlopeY][kOffset] += y * g;
    normal[kGain][kOffset] += sum[kP], normal[kGainX][kOffset] += sum[kPX], normal[kGainY][kOffset] += y * sum[kP];
    normal[kDisparity][kAcross] += sum[kGC], normal[kSlopeX][kAcross] += sum[kGCX];
    normal[kSlopeY][kAcross] += y * sum[kGC];
    normal[kAcross][kGain] += sum[kPC], normal[kAcross][kGainX] += sum[kPCX], normal[kAcross][kGainY] += y * sum[kPC];
    normal[kAcross][kAcross] += sum[kCC], normal[kAcross][kOffset] += sum[kC], normal[kOffset][kOffset] += sum[kW];
    right[kDisparity] += gr, right[kSlopeX] += sum[kGRX], right[kSlopeY] += y * gr;
    right[kGain] += sum[kPR], right[kGainX] += sum[kPRX], right[kGainY] += y * sum[kPR];
    right[kAcross] += sum[kCR], right[kOffset] += sum[kR];
    squares += sum[kRR], counted_pixels += sum[kPixels];
  }
  normal[kSlopeX][kGain] = normal[kDisparity][kGainX], normal[kSlopeY][kGain] = normal[kDisparity][kGainY];
  normal[kSlopeY][kGainX] = normal[kSlopeX][kGainY];
  e.weights = normal[kOffset][kOffset], e.pixels = counted_pixels;

  // What is known beforehand, see PatchAligner.
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
  e.variance = per_pivot[kDisparity];
  e.slope_variance = 0.5F * (per_pivot[kSlopeY] + l76 * l76 * per_pivot[kDisparity] + per_pivot[kSlopeX] +
                             l65 * l65 * per_pivot[kSlopeY] + l75 * l75 * per_pivot[kDisparity]);

  // The disparities of the ninths, as the step leaves them, beyond what noise does.
  const auto away = static_cast<float>((half + thirds + 1) / 2);
  Lanes of_ninths = zero, weight = zero, expected = zero;
  const Lanes noise = e.left / e.weights;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const float x = static_cast<float>(column - 1) * away, y = static_cast<float>(row - 1) * away;
      const Lanes gg = ninths[row][kGG + column];
      const Lanes gr = ninths[row][kGR + column] -
                       gg * (e.step[kDisparity] + x * e.step[kSlopeX] + y * e.step[kSlopeY]) -
                       ninths[row][kGP + column] * (e.step[kGain] + x * e.step[kGainX] + y * e.step[kGainY]) -
                       ninths[row][kG + column] * e.step[kOffset];
      const Lanes any = gg > zero ? one : zero;
      of_ninths += any * gr * gr / (gg + 1e-20F), expected += any * noise, weight += gg;
    }
  }
  const Lanes beyond = of_ninths - expected;
  e.scatter = (beyond > zero ? beyond : zero) / (weight + 1e-20F);
}

inline __attribute__((always_inline)) void step_of_bytes(const std::uint8_t* const* pixels, const EightWindows& of,
                                                         Eight& eight) {
  step_eight(pixels, of, eight);
}
inline __attribute__((always_inline)) void step_of_words(const std::uint16_t* const* pixels, const EightWindows& of,
                                                         Eight& eight) {
  step_eight(pixels, of, eight);
}
void call_step(const std::uint8_t* const* pixels, const EightWindows& of, Eight& eight) {
  Cloned<step_of_bytes>::call(pixels, of, eight);
}
void call_step(const std::uint16_t* const* pixels, const EightWindows& of, Eight& eight) {
  Cloned<step_of_words>::call(pixels, of, eight);
}

/// Near the mean of what a window sees, from its diagonals.
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
  e.per_scale[lane] = state.gain > 0 ? 1 / (options.outlier_sigmas * std::sqrt(squares)) : 0;
  const AlignPriors priors = align_priors(options, task.noise, state.gain);
  e.across_weight[lane] = priors.across, e.gain_slope_weight[lane] = priors.gain_slope;
}

void take(const Eight& e, int lane, PatchTask& task) {
  task.pixels = e.pixels[lane];
  task.support = e.weights[lane] / std::max(1.F, task.pixels);
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

template <class T>
void align(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
           int window_px, std::span<PatchTask* const> tasks) {
  Eight eight;
  const T* pixels[kEight];
  for (int lane = 0; lane < kEight; ++lane) {
    // What is left of the lanes does what the first does.
    PatchTask& task = *tasks[static_cast<std::size_t>(lane) < tasks.size() ? lane : 0];
    if (!(task.state.gain > 0)) task.state.offset = level_of(frame, task, window_px / 2);
    pixels[lane] = frame.row(task.y) + task.x;
    put(eight, lane, task, options);
  }
  const EightWindows windows{window_px,     frame.stride,   static_cast<float>(full), field.samples(),
                             field.width(), field.height(), field.slope_unit()};
  call_step(pixels, windows, eight);
  for (std::size_t lane = 0; lane < tasks.size(); ++lane) take(eight, static_cast<int>(lane), *tasks[lane]);
}

}  // namespace

void align_eight(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 int window_px, std::span<PatchTask* const> tasks) {
  std::visit([&](const auto& pixels) { align(pixels, full, field, options, window_px, tasks); }, frame);
}

}  // namespace slsd
