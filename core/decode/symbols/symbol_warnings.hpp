// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/options.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Camera pixels for one projector pixel, in the calibrated camera that sees the pattern smallest. Without a
/// calibration, of the paper's rig.
/// @thread reentrant
[[nodiscard]] double pattern_scale(const std::optional<Calibration>& calibration, const DecodeOptions& options);

/// Warnings about the pattern's choice of symbols at this scale, one sentence each. Empty if there is no risk. Computes
/// for a fraction of a second.
/// @thread reentrant
[[nodiscard]] std::vector<std::string> symbol_warnings(const PatternOptions& pattern, double scale);

}  // namespace slsd
