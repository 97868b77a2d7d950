// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>

#include "core/appearance/patch_task.hpp"
#include "core/lanes.hpp"

namespace slsd {

/// Sums over the pixels of eight windows, one in each lane. Letters are factors: G and C the slopes of the light along
/// and across the epipolar line, P the light, R the residual, x and y the place; One is none. All count a pixel by its
/// weight.
enum class PatchSum {
  kGG,
  kGGx,
  kGGy,
  kGGxx,
  kGGxy,
  kGGyy,
  kGP,
  kGPx,
  kGPy,
  kGPxx,
  kGPxy,
  kGPyy,
  kPP,
  kPPx,
  kPPy,
  kPPxx,
  kPPxy,
  kPPyy,
  kG,
  kGx,
  kGy,
  kP,
  kPx,
  kPy,
  kGC,
  kGCx,
  kGCy,
  kPC,
  kPCx,
  kPCy,
  kC,
  kCC,
  kOne,
  kGR,
  kGRx,
  kGRy,
  kPR,
  kPRx,
  kPRy,
  kCR,
  kR,
  kRR,
  kAgreed,  ///< share of the pixels that agree, saturated ones too
  kSums
};
inline constexpr int kPatchSums = static_cast<int>(PatchSum::kSums);

/// Normal equations of eight patches, and their solution.
struct EightEquations {
  Lanes normal[kFitted][kFitted];  ///< the lower triangle, in the order of Fitted
  Lanes right[kFitted], squares;   ///< of the residuals

  Lanes step[kFitted], left;  ///< the solution, and the sum of squares that it leaves
  Lanes positive;             ///< 1 if the matrix is positive definite
  Lanes variance, slope_variance;
  Lanes covariance[3][3];  ///< of disparity and slopes: the upper triangle
};

/// Sets up the equations. @param sums  one for each PatchSum
inline __attribute__((always_inline)) void set_up(const Lanes* sums, EightEquations& e) {
  using enum Fitted::Unknown;
  const auto sum = [&](PatchSum which) -> const Lanes& { return sums[static_cast<int>(which)]; };
  using enum PatchSum;
  const auto set = [&](Fitted::Unknown row, Fitted::Unknown column, PatchSum which) {
    e.normal[row][column] = sum(which);
  };
  set(kDisparity, kDisparity, kGG), set(kDisparity, kSlopeX, kGGx), set(kDisparity, kSlopeY, kGGy);
  set(kSlopeX, kSlopeX, kGGxx), set(kSlopeY, kSlopeX, kGGxy), set(kSlopeY, kSlopeY, kGGyy);
  set(kDisparity, kGain, kGP), set(kDisparity, kGainX, kGPx), set(kDisparity, kGainY, kGPy);
  set(kSlopeX, kGain, kGPx), set(kSlopeX, kGainX, kGPxx), set(kSlopeX, kGainY, kGPxy);
  set(kSlopeY, kGain, kGPy), set(kSlopeY, kGainX, kGPxy), set(kSlopeY, kGainY, kGPyy);
  set(kGain, kGain, kPP), set(kGainX, kGain, kPPx), set(kGainY, kGain, kPPy);
  set(kGainX, kGainX, kPPxx), set(kGainY, kGainX, kPPxy), set(kGainY, kGainY, kPPyy);
  set(kDisparity, kOffset, kG), set(kSlopeX, kOffset, kGx), set(kSlopeY, kOffset, kGy);
  set(kGain, kOffset, kP), set(kGainX, kOffset, kPx), set(kGainY, kOffset, kPy);
  set(kDisparity, kAcross, kGC), set(kSlopeX, kAcross, kGCx), set(kSlopeY, kAcross, kGCy);
  set(kAcross, kGain, kPC), set(kAcross, kGainX, kPCx), set(kAcross, kGainY, kPCy);
  set(kAcross, kAcross, kCC), set(kAcross, kOffset, kC), set(kOffset, kOffset, kOne);
  e.right[kDisparity] = sum(kGR), e.right[kSlopeX] = sum(kGRx), e.right[kSlopeY] = sum(kGRy);
  e.right[kGain] = sum(kPR), e.right[kGainX] = sum(kPRx), e.right[kGainY] = sum(kPRy);
  e.right[kAcross] = sum(kCR), e.right[kOffset] = sum(kR);
  e.squares = sum(kRR);
}

/// Solves them: normal = L D L^T. The lower triangle becomes L.
inline __attribute__((always_inline)) void solve(EightEquations& e) {
  using enum Fitted::Unknown;
  const Lanes zero{}, one = zero + 1;
  auto& normal = e.normal;
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
    forward[i] = e.right[i];
    for (int k = 0; k < i; ++k) forward[i] -= normal[i][k] * forward[k];
    taken += forward[i] * forward[i] * per_pivot[i];
  }
  for (int i = kFitted - 1; i >= 0; --i) {
    e.step[i] = forward[i] * per_pivot[i];
    for (int k = i + 1; k < kFitted; ++k) e.step[i] -= normal[k][i] * e.step[k];
  }
  const Lanes left = e.squares - taken;
  e.left = left > zero ? left : zero;
  const Lanes& l65 = normal[kSlopeY][kSlopeX];
  const Lanes& l76 = normal[kDisparity][kSlopeY];
  const Lanes l75 = normal[kDisparity][kSlopeX] - l76 * l65;
  const Lanes &of_x = per_pivot[kSlopeX], &of_y = per_pivot[kSlopeY];
  e.variance = per_pivot[kDisparity];
  const Lanes variance_x = of_x + l65 * l65 * of_y + l75 * l75 * e.variance, variance_y = of_y + l76 * l76 * e.variance;
  e.slope_variance = 0.5F * (variance_x + variance_y);
  e.covariance[0][0] = e.variance, e.covariance[1][1] = variance_x, e.covariance[2][2] = variance_y;
  e.covariance[0][1] = l75 * -e.variance, e.covariance[0][2] = l76 * -e.variance;
  e.covariance[1][2] = l76 * l75 * e.variance - l65 * of_y;
}

/// Results of a step for eight patches.
struct EightSteps {
  EightEquations equations;
  Lanes weights, pixels, agreed, scatter;
};

/// Applies a lane's step to its task, or marks it as failed.
inline void take(const EightSteps& of, int lane, PatchTask& task) {
  using enum Fitted::Unknown;
  const EightEquations& e = of.equations;
  task.pixels = of.pixels[lane];
  task.support = of.agreed[lane] / std::max(1.F, task.pixels);
  PatchState& state = task.state;
  const float gain = state.gain + e.step[kGain][lane];
  bool finite = true;
  for (const Lanes& step : e.step) finite = finite && std::isfinite(step[lane]);
  task.failed = !(of.weights[lane] > 2 * kFitted) || !(e.positive[lane] > 0) || !finite || !(gain > task.noise);
  if (task.failed) return;
  state.gain = gain, state.offset += e.step[kOffset][lane];
  state.gain_x += e.step[kGainX][lane], state.gain_y += e.step[kGainY][lane];
  const auto moved = [&](Fitted::Unknown k) { return std::clamp(e.step[k][lane] / gain, -1.F, 1.F); };
  task.moved = moved(kDisparity);
  state.disparity += task.moved, state.slope_x += moved(kSlopeX), state.slope_y += moved(kSlopeY);
  state.across += moved(kAcross);
  task.residual = std::sqrt(e.left[lane] / of.weights[lane]);
  task.scatter = std::sqrt(of.scatter[lane]) / gain;
  task.variance = e.variance[lane] / (gain * gain), task.slope_variance = e.slope_variance[lane] / (gain * gain);
}

}  // namespace slsd
