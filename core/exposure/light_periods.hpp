// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slsd {

/// Periods of light that varies while a camera exposes.
struct LightPeriods {
  double refresh_hz = 60.0;    ///< rate of the projector, whose micromirrors write grey and colour sequentially within
                               ///< a frame; 0: steady light
  double power_line_hz = 0.0;  ///< frequency of the mains for lamps, which are brightest twice a period; 0: none, or
                               ///< unknown

  [[nodiscard]] double projector_us() const { return refresh_hz > 0 ? 1e6 / refresh_hz : 0.0; }  ///< 0: none
  [[nodiscard]] double lamps_us() const { return power_line_hz > 0 ? 0.5e6 / power_line_hz : 0.0; }
};

/// Fit of an exposure to the light. If it lasts n whole periods and a part, the light in that part depends on when the
/// exposure began. The brightness then varies from frame to frame. Up to 1 % is accepted.
struct ExposureFit {
  bool projector = true;
  bool lamps = true;
  std::optional<double> shorter_us = {};  ///< if it does not fit, the nearest exposures that fit both lights, none
                                          ///< above a second
  std::optional<double> longer_us = {};

  [[nodiscard]] bool fits() const { return projector && lamps; }
};

/// @param exposure_us  above 0
/// @thread reentrant
[[nodiscard]] ExposureFit fit_exposure(double exposure_us, const LightPeriods& periods);

/// Says which lights the exposure does not suit, and the nearest that suit: "is not a whole multiple of a projector
/// frame (16667 us at 60 Hz), so frames differ in brightness: set 16667 or 33333". Empty if it suits.
/// @param exposure_us  above 0
/// @thread reentrant
[[nodiscard]] std::string exposure_misfit(double exposure_us, const LightPeriods& periods);

/// All exposures that fit both lights, shortest first, in microseconds; empty if both are steady and any exposure fits.
/// @param longest_us  up to 10 s
/// @thread reentrant
[[nodiscard]] std::vector<double> fitting_exposures(const LightPeriods& periods, double longest_us);

}  // namespace slsd
