// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "core/appearance/patch_map.hpp"

namespace slsd {

struct AlignOptions {
  float across_sigma_px = 0.15F;  ///< deviation of the pattern from the epipolar lines; 0: none
  /// Standard deviation of the gain's change for one camera px, as a share of the gain; 0: no prior. Small windows need
  /// it, because light that fades within them resembles a displacement.
  float gain_slope_sigma = 0;
  int steps = 4;  ///< of align_cells()
  /// Model error in a good fit, as a share of the gain.
  float misfit_share = 0.02F;
  /// Standard deviations of noise and misfit at which a pixel counts half: the surface may end there or carry print.
  float outlier_sigmas = 4;
};

/// Standard deviations by which a model may lie above or below the full level while noise decides about saturation: at
/// the full level, a saturated pixel's mean residual is then 0.8 of them, as that of a normal distribution.
inline constexpr float kCensoredSigmas = 3.2F;

/// The fitted parameters, in the order in which they are eliminated: the disparity last, because its variance is then
/// the inverse of the last pivot. All but the offset are in units of gain times px, or of levels.
struct Fitted {
  enum Unknown { kOffset, kGain, kGainX, kGainY, kAcross, kSlopeX, kSlopeY, kDisparity };
};
inline constexpr int kFitted = Fitted::kDisparity + 1;
/// Number of patches aligned at once.
inline constexpr int kEight = 8;

/// A square window of the frame, to be aligned around its centre pixel.
struct PatchTask {
  int x = 0, y = 0;          ///< the centre
  PatchMap map;              ///< around the same pixel
  float noise = 0;           ///< one standard deviation of a pixel, grey levels
  PatchState state;          ///< in: the start; out: the result; gain 0: unknown
  bool settled = false;      ///< set by the caller: a step that moves little was the last
  bool failed = false;       ///< the window does not determine the place; the other fields are unchanged
  float moved = 0;           ///< the last step's change of the disparity, projector px
  float residual = 0;        ///< root mean square after the last step, grey levels
  float pixels = 0;          ///< number of pixels
  float support = 0;         ///< share of them that agreed with the pattern before the last step; saturated ones too
  float scatter = 0;         ///< scatter of the ninths about the plane, px, beyond noise
  float variance = 0;        ///< variance of the disparity, for a noise of one grey level in each pixel
  float slope_variance = 0;  ///< variance of its slopes, mean of both
};

/// A square of the pattern on a bent surface, to be aligned wherever the frame shows it. The patch's window has to
/// contain the square; it may reach beyond the frame, but its centre may not.
struct CellTask {
  PatchTask patch{};
  int window_px = 1;                                           ///< odd: side of the window
  Eigen::Vector2f square_middle_px = Eigen::Vector2f::Zero();  ///< projector px
  float square_half_px = 0;                                    ///< half side, along both of the projector's axes
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();        ///< of disparity and slopes, as PatchTask::variance
};

/// Prior knowledge of `across` and of each of the gain's slopes: the amounts added to the diagonal of the normal
/// matrix. @tparam Number  float or Lanes
template <class Number>
struct AlignPriors {
  Number across, gain_slope;
};
/// @param noise  one standard deviation of a pixel, grey levels
template <class Number>
[[nodiscard]] inline __attribute__((always_inline)) AlignPriors<Number> align_priors(const AlignOptions& options,
                                                                                     const Number& noise,
                                                                                     const Number& gain) {
  const Number zero = 0 * noise, one = zero + 1;
  const Number per_gain = one / (gain > one ? gain : one), of_noise = noise * noise * per_gain * per_gain;
  const float across = options.across_sigma_px, slope = options.gain_slope_sigma;
  return {across > 0 ? of_noise / (across * across) : zero + 1e9F,
          slope > 0 ? (of_noise + options.misfit_share * options.misfit_share) / (slope * slope) : zero};
}

/// The residual of a saturated pixel and its weight. The pixel's light is at the full level or anywhere above, so the
/// pixel agrees with any model above that level (Tobin 1958). Steps by the score of that censored normal distribution,
/// with a parabola for the part where noise decides.
struct Censored {
  float residual, weight;
};
/// @param residual  of the full level
/// @param sigma     one standard deviation of noise and misfit, grey levels
[[nodiscard]] inline Censored censored(float residual, float sigma) {
  const float above = residual + kCensoredSigmas * sigma;
  return {std::max({0.F, residual, 0.5F * above}), std::clamp(above / (2 * kCensoredSigmas * sigma), 0.F, 1.F)};
}

}  // namespace slsd
