// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>

#include "core/calibrate/doubt/calibration_doubts.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/decoding.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// Reads the pattern without a calibration and compares the symbols with the calibration. Takes about a second.
/// @param camera  index in the calibration
/// @param read    out: number of symbols read
/// @return a sentence about the calibration; empty if it explains the symbols, or if too few were read
/// @thread reentrant
[[nodiscard]] std::string doubt_by_frame(const GreyView& frame, const Pattern& pattern, const Calibration& calibration,
                                         std::size_t camera, const DepthRange& range, std::size_t& read);

/// Says why none of a frame's regions became a point, with the remedy, as far as their number by status shows it.
/// @thread reentrant
[[nodiscard]] std::string doubt_by_counts(const RegionCounts& regions);

}  // namespace slsd
