// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/symbol_warnings.hpp"

#include <algorithm>
#include <limits>

#include "core/decode/grid/lattice_frame.hpp"
#include "core/decode/symbols/separability.hpp"

namespace slsd {

double pattern_scale(const std::optional<Calibration>& calibration, const DecodeOptions& options) {
  if (!calibration) return LookOptions{}.camera_px_per_projector_px;
  double smallest = std::numeric_limits<double>::max();
  for (const CalibratedCamera& camera : calibration->cameras) {
    const ExpectedFrames frames(camera, calibration->projector, options.middle_depth_mm());
    smallest = std::min<double>(smallest, frames.in_the_middle().scale);
  }
  return smallest;
}

std::vector<std::string> symbol_warnings(const PatternOptions& pattern, double scale) {
  LookOptions look;
  look.camera_px_per_projector_px = scale;
  look.symbol_size_px = pattern.symbol_size_px;
  look.spacing_px = pattern.spacing_px;
  const auto separability = assess_separability(pattern.symbols, look);
  if (!separability) return {to_string(separability.error())};
  return separability_warnings(*separability, pattern.symbol_size_px);
}

}  // namespace slsd
