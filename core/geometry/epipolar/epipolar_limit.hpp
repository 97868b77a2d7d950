// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <optional>

namespace slsd {

/// Distance of symbols from their epipolar lines, projector px, above which the rig no longer matches its calibration.
/// @param expected_px  the calibration's own figure; empty if it has none
/// @thread reentrant
[[nodiscard]] constexpr double epipolar_limit_px(std::optional<double> expected_px) {
  constexpr double kLeastPx = 0.5, kTimes = 3;
  return std::max(kLeastPx, kTimes * expected_px.value_or(0));
}

/// The same limit for medians of many symbols, which are much more exact than single symbols.
/// @thread reentrant
[[nodiscard]] constexpr double watch_limit_px(std::optional<double> expected_px) {
  constexpr double kLeastPx = 0.25, kTimes = 3;
  return std::max(kLeastPx, kTimes * expected_px.value_or(0));
}

/// Largest distance from its epipolar line at which a symbol is still accepted, projector px. It is the sum of a
/// calibrated rig's allowed error and a symbol's own error. It exceeds the limit, so that a rig beyond the limit still
/// gives points that show the fault.
/// @thread reentrant
[[nodiscard]] constexpr double epipolar_gate_px(std::optional<double> expected_px) {
  constexpr double kSymbolPx = 1;
  return epipolar_limit_px(expected_px) + kSymbolPx;
}

}  // namespace slsd
