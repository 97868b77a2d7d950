// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/decode/grid/cell_rays.hpp"
#include "core/decode/grid/epipolar_view.hpp"
#include "core/decode/lattice.hpp"
#include "core/exposure/frame_noise.hpp"

namespace slsd {

/// One standard deviation of a symbol's centre from the noise of the pixels alone, camera px.
///
/// The soft threshold admits noise only along the edge, in a band about a pixel and a half wide. For a compact symbol,
/// var = (n / r c)^2 / sqrt(w): w is the area, n the noise, c the contrast and r the ramp.
/// @param weight            lit area, camera px squared
/// @param background, gain  grey levels: the dark, and what light adds to it
/// @thread reentrant
[[nodiscard]] float noise_of_centre_px(float weight, float background, float gain, const FrameNoise& noise);

/// Estimates the error of each centre of a lattice, along the epipolar line and across it.
///
/// Besides noise, relief, print, shadow or an edge under the symbol disturbs a centre. Three signs show this. Across
/// the epipolar line no depth moves a symbol, so its residual is error alone. Its disparity differs from its
/// neighbours' more than on any surface that symbols can follow. Its shape differs from its letter. So, all in camera
/// px and added in squares,
///
///     0.55 noise,  0.01,  0.4 across,  0.4 uneven,  0.25 roughness,  0.25 unevenness,
///     sqrt(roughness unevenness),  0.01 misfit^2,  0.015 if no neighbours show its bend
///
/// across: the residual less the frame's median, which is the calibration's error. roughness: the root mean square of
/// the residuals of the symbol and its neighbours, beyond noise and the 0.03 px of smooth surfaces. uneven: the
/// symbol's disparity off the mean of opposite neighbours, less the neighbours' own value, which is the surface's
/// curvature. unevenness: its root mean square with the neighbours', beyond noise and 0.02 px. misfit^2: of the shape,
/// in standard deviations, beyond the frame's median. A disturbed centre is rough and uneven at once, so the product
/// counts most; a nearby curved surface is uneven alone. The factors are fitted to rendered frames
/// (docs/notes/2026-11-decoder.md).
/// @thread thread-bound: keeps its buffers
class CentreJudge {
 public:
  /// @param view  null without a calibration: the distance across the epipolar line is then unknown
  void judge(const FrameNoise& noise, const EpipolarView* view, const CellRays& cells, Executor& executor,
             Lattice& lattice);

 private:
  void measure_across(const EpipolarView& view, const CellRays& cells, Executor& executor,
                      const std::vector<LatticeSymbol>& symbols);
  void measure_unevenness(const std::vector<LatticeSymbol>& symbols, Executor& executor);

  std::vector<float> across_px_, disparities_px_, beyond_px_, uneven_px_;
};

}  // namespace slsd
