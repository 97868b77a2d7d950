// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <optional>

namespace slsd {

/// Distance of symbols from their epipolar lines, projector px, from which on the rig is not as it was calibrated.
/// @param expected_px  what the calibration says of itself; nothing: it does not
/// @thread reentrant
[[nodiscard]] constexpr double epipolar_limit_px(std::optional<double> expected_px) {
  constexpr double kLeastPx = 0.5, kTimes = 3;
  return std::max(kLeastPx, kTimes * expected_px.value_or(0));
}

/// The same of the medians of many symbols, which are far more exact than each of them.
/// @thread reentrant
[[nodiscard]] constexpr double watch_limit_px(std::optional<double> expected_px) {
  constexpr double kLeastPx = 0.25, kTimes = 3;
  return std::max(kLeastPx, kTimes * expected_px.value_or(0));
}

/// Largest distance from its epipolar line at which a symbol is still accepted, projector px. It is the sum of the
/// error that a calibrated rig may have and of a symbol's own error. It exceeds the limit, so that a rig beyond the
/// limit still gives points that show it.
/// @thread reentrant
[[nodiscard]] constexpr double epipolar_gate_px(std::optional<double> expected_px) {
  constexpr double kSymbolPx = 1;
  return epipolar_limit_px(expected_px) + kSymbolPx;
}

}  // namespace slsd
