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
/// The soft threshold lets noise in along the edge alone, a band about a pixel and a half wide: with w the area, n the
/// noise and c the contrast, var = (n / r c)^2 / sqrt(w), r the ramp, for a compact symbol.
/// @param weight            lit area, camera px squared
/// @param background, gain  grey levels: the dark, and what light adds to it
/// @thread reentrant
[[nodiscard]] float noise_of_centre_px(float weight, float background, float gain, const FrameNoise& noise);

/// Tells how exact each centre of a lattice is, along the epipolar line and across it.
///
/// What disturbs a centre besides noise is relief, print, shadow or an edge under the symbol. It shows in three ways:
/// across the epipolar line, where no depth moves a symbol and what is left over is error alone; in a disparity off
/// those around, as no surface that symbols can follow has; and in the symbol's shape. So, all in camera px and added
/// in squares,
///
///     0.55 noise,  0.01,  0.4 across,  0.4 uneven,  0.25 roughness,  0.25 unevenness,
///     sqrt(roughness unevenness),  0.01 misfit^2,  0.015 where no neighbours tell of its bend
///
/// across: the residual less the frame's median (that is the calibration's); roughness: the root mean square of the
/// symbol's and its neighbours', beyond noise and the 0.03 px of smooth surfaces; uneven: the disparity beyond that of
/// the neighbours to both sides, less the same of the neighbours, which a surface's own curvature has; unevenness: its
/// root mean square with theirs, beyond noise and 0.02 px; misfit^2: of the shape, in standard deviations, beyond the
/// frame's median. What disturbs centres makes them rough and uneven, so both together count most: a surface near the
/// devices that symbols can follow is uneven alone. The factors are fitted to rendered frames
/// (docs/notes/2026-11-decoder.md).
/// @thread thread-bound: keeps its buffers
class CentreJudge {
 public:
  /// @param view  null where there is no calibration: nothing is known then of what lies across
  void judge(const FrameNoise& noise, const EpipolarView* view, const CellRays& cells, Executor& executor,
             Lattice& lattice);

 private:
  void measure_across(const EpipolarView& view, const CellRays& cells, Executor& executor,
                      const std::vector<LatticeSymbol>& symbols);
  void measure_unevenness(const std::vector<LatticeSymbol>& symbols, Executor& executor);

  std::vector<float> across_px_, disparities_px_, beyond_px_, uneven_px_;
};

}  // namespace slsd
