// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <optional>

namespace slsd {

/// From how far off their epipolar lines on, in projector px, symbols say that the rig is not as it was calibrated.
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

/// How far off its epipolar line a symbol is still taken for what it seems: as far as a rig may be off that is as it
/// was calibrated, and as a symbol may be off by itself. Wider than the limit, so that a rig beyond it still gives
/// points that show it.
/// @thread reentrant
[[nodiscard]] constexpr double epipolar_gate_px(std::optional<double> expected_px) {
  constexpr double kSymbolPx = 1;
  return epipolar_limit_px(expected_px) + kSymbolPx;
}

}  // namespace slsd
