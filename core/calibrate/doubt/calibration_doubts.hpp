// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/calibrate/doubt/rig_outlook.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {

/// Faults that make a calibration implausible within a range of depths: one sentence for each, with the remedy. Empty
/// for any rig that someone might build. It cannot distinguish a rig from its mirror image; only symbols can, see
/// symbol_doubt().
/// @thread reentrant
[[nodiscard]] std::vector<std::string> calibration_doubts(const Calibration& calibration, const DepthRange& range);

/// Warnings about the effect of the calibration's reported error on dense clouds. Each says what to do. Empty if the
/// error is unknown, or small beside the clouds' own error.
/// @thread reentrant
[[nodiscard]] std::vector<std::string> calibration_error_warnings(const Calibration& calibration);

/// Compares a camera's calibration with symbols that were read without the calibration.
/// @param matches  at least kSymbolsForDoubt; a few of them may be wrong
/// @param gate_px  largest accepted distance of symbols from their epipolar lines
/// @return a sentence that says why the symbols give no points, with the remedy; empty if the calibration explains most
/// @thread reentrant
[[nodiscard]] std::string symbol_doubt(std::span<const Match> matches, const CameraRig& rig, const DepthRange& range,
                                       double gate_px);
inline constexpr std::size_t kSymbolsForDoubt = 24;

}  // namespace slsd
