// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/code/pattern.hpp"
#include "core/decode/options.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// Resolution of dense clouds with a pattern, in the middle of the working range. Rules of thumb from rendered frames.
struct DenseOutlook {
  double depth_mm;          ///< depth of the middle, along the camera's z axis
  double pitch_px;          ///< pitch of the symbols, in the camera
  double thinnest_part_mm;  ///< less than half is measured of what is narrower
  double half_transfer_mm;  ///< the period of waves of which half the height is left: they bend within a window
  double mm_per_px;         ///< change of depth for one projector px
  /// The pitch is so much larger than the largest window that many of those see no edge of a symbol.
  bool too_coarse;
};

/// @param window_px  of the mapper: DenseMapper::window_px()
[[nodiscard]] DenseOutlook dense_outlook(const Pattern& pattern, const Calibration& calibration,
                                         std::size_t camera_index, const DecodeOptions& decode, int window_px);

/// Draws the camera's image of a white wall at a depth, in focus and without noise: to try a pattern and a calibration
/// on.
[[nodiscard]] Grey8 wall_frame(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                               double depth_mm);

}  // namespace slsd
