// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/code/pattern.hpp"
#include "core/decode/options.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// Resolution of dense clouds with a pattern, at the middle of the working range. Rules of thumb from rendered frames.
struct DenseOutlook {
  double depth_mm;          ///< depth of the middle, along the camera's z axis
  double pitch_px;          ///< pitch of the symbols, in the camera
  double thinnest_part_mm;  ///< of narrower parts, less than half is measured
  double half_transfer_mm;  ///< wavelength of waves that keep half their height, because they bend within a window
  double mm_per_px;         ///< change of depth for one projector px
  /// The pitch is so much larger than the largest window that many windows contain no edge of a symbol.
  bool too_coarse;
};

/// @param window_px  the mapper's DenseMapper::window_px()
[[nodiscard]] DenseOutlook dense_outlook(const Pattern& pattern, const Calibration& calibration,
                                         std::size_t camera_index, const DecodeOptions& decode, int window_px);

/// Draws the camera's image of a white wall at a depth, in focus and without noise, to test a pattern and a
/// calibration.
[[nodiscard]] Grey8 wall_frame(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                               double depth_mm);

}  // namespace slsd
