// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "core/exposure/frame_light.hpp"
#include "core/exposure/light_periods.hpp"

namespace slsd {

/// Troubles with the light in a camera's frames.
enum class Trouble {
  kNoPattern,          ///< the pattern is not visible
  kTooMuchLight,       ///< clipped even with the shortest exposure that suits the projector, and no gain
  kTooLittleLight,     ///< dark even with the longest exposure and the highest gain allowed
  kAmbient,            ///< between the symbols it is nearly as bright as on them
  kBlurred,            ///< the symbols' edges run into one another
  kNoisy,              ///< pixels change between frames nearly as much as the contrast of the symbols
  kUneven,             ///< near parts are clipped, or far parts are dark: no exposure suits both
  kMoves,              ///< the scene moves, so that a longer exposure blurs it
  kFlickers,           ///< the brightness changes from frame to frame
  kClipped,            ///< symbols are saturated, by an unknown amount
  kGrain,              ///< neighbouring pixels share their noise, as compression and denoising leave it
  kGamma,              ///< grey levels are not proportional to light
  kAutomaticExposure,  ///< the brightness changes from frame to frame, and the exposure is not configured
  kUnevenPitch,        ///< the projector scales its picture, so that columns of symbols are unequally wide
};
inline constexpr int kTroubleCount = 14;

/// "ambient", as in the JSON of slsctl exposure.
[[nodiscard]] std::string_view to_string(Trouble trouble);
/// Remedy for a trouble, in a sentence or two.
[[nodiscard]] std::string_view remedy(Trouble trouble);

/// A camera's exposure setting.
struct ExposureSetting {
  double exposure_us = 0;
  double gain_db = 0;
};

struct ExposureLimits {
  LightPeriods periods;
  double exposure_max_us = 100'000;  ///< longest exposure: moving objects are blurred over that time
  double gain_max_db = 24;           ///< noise grows with it
};

/// Advice on the setting.
struct ExposureAdvice {
  double brighter = 1;      ///< factor of light, or gain, that brings the symbols to the target level
  bool look_again = false;  ///< clipped: the excess is unknown, so apply this setting and look again
  std::optional<ExposureSetting> setting = {};  ///< new setting, if the present one is known
  std::vector<Trouble> troubles = {};
};

/// Proposes exposure and gain with which the brightest symbols reach three quarters of full. It uses as little gain as
/// possible, and an exposure of whole periods of the light. If the scene moves, it uses the shortest such exposure, and
/// gain compensates for the rest.
/// @param light    of one frame, or of two taken with the same setting; of one, noise, motion and flicker are unknown
/// @param present  the setting of those frames, if known
/// @thread reentrant
[[nodiscard]] ExposureAdvice advise_exposure(const FrameLight& light, const std::optional<ExposureSetting>& present,
                                             const ExposureLimits& limits);

}  // namespace slsd
