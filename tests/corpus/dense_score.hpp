// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// What a rendered camera saw: the depth of each pixel, along its z axis, mm, NaN where nothing is; and whether the
/// projector lights it.
struct DenseTruth {
  Image<float> depth_mm;
  Image<std::uint8_t> lit;
};

/// Reads depth.npy and mask.npy of a rendered scene's folder.
/// @errors kNotFound, kMalformed
[[nodiscard]] Result<DenseTruth> read_dense_truth(const std::filesystem::path& folder);

/// How good a depth map is. A disparity is in camera px, as if both images were rectified; a millimetre lies along the
/// camera's ray. Gross is what is off by more than 3 px or 5 mm; root mean squares are without it.
struct DenseScore {
  std::size_t lit = 0, measured = 0;  ///< pixels; measured: of those lit
  double complete = 0;                ///< share of the lit pixels
  double median_px = 0, rms_px = 0, median_mm = 0, rms_mm = 0;
  double gross = 0;                               ///< share of the measured
  double unlit = 0;                               ///< points on pixels that are not lit, over those on lit ones
  double unlit_far = 0;                           ///< those of them more than 2 px from what is lit
  double error_over_sigma = 0, beyond_three = 0;  ///< standard deviation, without gross; share
  struct Edge {
    double complete = 0, gross = 0;
  };
  std::array<Edge, 4> edges;  ///< 0 to 2, 2 to 4, 4 to 6 px, and farther from a jump in depth
};

/// @param depth_mm, sigma_mm  a value to a pixel, NaN where nothing was measured
[[nodiscard]] DenseScore score_dense(const DenseTruth& truth, const Calibration& calibration,
                                     std::span<const float> depth_mm, std::span<const float> sigma_mm);

}  // namespace slsd
