// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <span>

#include "core/appearance/align_patch.hpp"

namespace slsd {

/// Number of patches aligned at once.
inline constexpr int kEight = 8;

/// A square window of the frame, to be aligned around its centre pixel.
struct PatchTask {
  int x = 0, y = 0;          ///< the centre; the window lies within the frame
  PatchMap map;              ///< around the same pixel
  float noise = 0;           ///< one standard deviation of a pixel, grey levels
  PatchState state;          ///< in: the start; out: the result; gain 0: unknown. Bends are ignored
  bool settled = false;      ///< set by the caller: a step that moves little was the last
  bool failed = false;       ///< the window does not determine the place; the other fields are unchanged
  float moved = 0;           ///< the last step's change of the disparity, projector px
  float residual = 0;        ///< root mean square after the last step, grey levels
  float pixels = 0;          ///< number of pixels
  float support = 0;         ///< share of them that agreed with the pattern before the last step
  float scatter = 0;         ///< scatter of the ninths about the plane, px, beyond noise
  float variance = 0;        ///< variance of the disparity, for a noise of one grey level in each pixel
  float slope_variance = 0;  ///< variance of its slopes, mean of both
};

/// Prior knowledge of `across` and of each of the gain's slopes: the amounts added to the diagonal of the normal
/// matrix. Its unknowns are in units of gain times px and of levels.
struct AlignPriors {
  float across, gain_slope;
};
/// @param noise  one standard deviation of a pixel, grey levels
[[nodiscard]] inline AlignPriors align_priors(const AlignOptions& options, float noise, float gain) {
  const float per_gain = 1 / std::max(1.F, gain), of_noise = noise * noise * per_gain * per_gain;
  const auto weight = [](float squares, float sigma) { return squares / (sigma * sigma); };
  return {options.across_sigma_px > 0 ? weight(of_noise, options.across_sigma_px) : 1e9F,
          options.gain_slope_sigma > 0
              ? weight(of_noise + options.misfit_share * options.misfit_share, options.gain_slope_sigma)
              : 0};
}

/// One step of PatchAligner for up to eight windows of the same size: the same equations, one patch in each lane. This
/// is several times faster than one by one: no operation crosses lanes, and the eight systems of equations are solved
/// at once.
/// @param full       the level of a saturated pixel, which does not count
/// @param window_px  odd: side of the windows
/// @thread reentrant
void align_eight(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 int window_px, std::span<PatchTask* const> tasks);

}  // namespace slsd
