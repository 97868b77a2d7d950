// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/exposure_advice.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr double kTarget = 0.75;  // of full: below nonlinear sensor response, above significant noise
constexpr double kGoodEnough = 1.15;
constexpr double kClippedMax = 0.05;  // of the tiles: a shiny spot is no reason to darken the whole image
constexpr double kMostlyClipped = 0.5;
constexpr double kPatternedMin = 0.02;
constexpr double kDarkToLitMax = 0.5;
// Frames of the corpus have 0.03 to 0.055. With more blur they lose symbols from 0.08 on, and all by 0.1.
constexpr double kEdgeToPeriodMax = 0.075;
constexpr double kContrastToNoiseMin = 8.0;
constexpr double kUnevenMax = 20.0;
constexpr double kMovedMax = 0.05;
constexpr double kFlickerMax = 0.03;
constexpr double kGrainMax = 0.2;  // a plain sensor has 0

double ratio_of(double gain_db) {
  return std::pow(10.0, gain_db / 20.0);
}

double decibels_of(double ratio) {
  return 20.0 * std::log10(ratio);
}

// How far above full the true level lies is unknown: steps that halve the light or more reach it in a few looks.
double wanted_change(const LightLevels& levels) {
  if (levels.clipped_share > kMostlyClipped) return 0.25;
  if (levels.clipped_share > kClippedMax) return 0.5;
  const double change = kTarget * levels.full / levels.lit_brightest;
  return change < kGoodEnough && change > 1 / kGoodEnough ? 1.0 : change;
}

// Troubles visible in the frames themselves, whatever the setting.
void find_troubles(const FrameLight& light, std::vector<Trouble>& troubles) {
  const LightLevels& levels = light.levels;
  const auto& change = light.change;
  const auto note = [&](bool found, Trouble trouble) {
    if (found) troubles.push_back(trouble);
  };
  const bool clipped = levels.clipped_share > kMostlyClipped;
  const bool flickers = change && std::max(change->flicker(), change->bands) > kFlickerMax;
  note(levels.clipped_share > kClippedMax, Trouble::kClipped);
  note(!clipped && levels.dark > kDarkToLitMax * levels.lit, Trouble::kAmbient);
  note(levels.edge_px > kEdgeToPeriodMax * levels.period_px, Trouble::kBlurred);
  note(change && levels.contrast() < kContrastToNoiseMin * change->noise, Trouble::kNoisy);
  note(levels.lit_brightest > kUnevenMax * std::max(levels.lit_faintest, 1.0), Trouble::kUneven);
  note(change && change->moved_share > kMovedMax, Trouble::kMoves);
  note(flickers, light.exposure_is_configured ? Trouble::kFlickers : Trouble::kAutomaticExposure);
  note(light.pitch && light.pitch->is_uneven(), Trouble::kUnevenPitch);
  note(!flickers && light.between.neighbours > kGrainMax, Trouble::kGrain);
  note(!flickers && light.gamma && light.gamma->bends(), Trouble::kGamma);
}

double choose_exposure(double ideal_us, bool shortest, const ExposureLimits& limits) {
  const std::vector<double> fitting = fitting_exposures(limits.periods, limits.exposure_max_us);
  if (fitting.empty()) return std::min(ideal_us, limits.exposure_max_us);
  double chosen_us = fitting.front();
  for (const double fitting_us : fitting) {
    if (!shortest && fitting_us <= kGoodEnough * ideal_us) chosen_us = fitting_us;
  }
  return chosen_us;
}

bool has(const std::vector<Trouble>& troubles, Trouble trouble) {
  return std::ranges::find(troubles, trouble) != troubles.end();
}

ExposureSetting choose_setting(const ExposureSetting& present, const ExposureLimits& limits, ExposureAdvice& advice) {
  const double ideal_us = advice.brighter * present.exposure_us * ratio_of(present.gain_db);
  ExposureSetting setting;
  setting.exposure_us = choose_exposure(ideal_us, has(advice.troubles, Trouble::kMoves), limits);
  const double gain_db = decibels_of(ideal_us / setting.exposure_us);
  setting.gain_db = std::clamp(gain_db, 0.0, limits.gain_max_db);
  if (gain_db > limits.gain_max_db + 1) advice.troubles.push_back(Trouble::kTooLittleLight);
  if (gain_db < -2) advice.troubles.push_back(Trouble::kTooMuchLight);
  return setting;
}

}  // namespace

std::string_view to_string(Trouble trouble) {
  switch (trouble) {
    case Trouble::kNoPattern:
      return "no_pattern";
    case Trouble::kTooMuchLight:
      return "too_much_light";
    case Trouble::kTooLittleLight:
      return "too_little_light";
    case Trouble::kAmbient:
      return "ambient";
    case Trouble::kBlurred:
      return "blurred";
    case Trouble::kNoisy:
      return "noisy";
    case Trouble::kUneven:
      return "uneven";
    case Trouble::kMoves:
      return "moves";
    case Trouble::kFlickers:
      return "flickers";
    case Trouble::kClipped:
      return "clipped";
    case Trouble::kGrain:
      return "grain";
    case Trouble::kGamma:
      return "gamma";
    case Trouble::kAutomaticExposure:
      return "automatic_exposure";
    case Trouble::kUnevenPitch:
      return "uneven_pitch";
  }
  return {};
}

std::string_view remedy(Trouble trouble) {
  switch (trouble) {
    case Trouble::kNoPattern:
      return "the pattern is not visible: point camera and projector at the object, take the caps off, and look at "
             "slsctl frame; if the frame is dark, allow a longer exposure";
    case Trouble::kTooMuchLight:
      return "too bright even with the shortest exposure that suits the projector: close the aperture, put a grey "
             "filter on the lens, or dim the projector";
    case Trouble::kTooLittleLight:
      return "too dark even with the longest exposure and the highest gain allowed: open the aperture, move closer, "
             "use a brighter projector, or coat the object";
    case Trouble::kAmbient:
      return "room light is nearly as strong as the projector's, which no exposure changes: darken the room, move "
             "closer, or put a filter for the projector's light on the lens";
    case Trouble::kBlurred:
      return "the symbols' edges blur into each other: focus camera and projector, close the aperture, move closer, or "
             "use larger symbols; expose moving objects for a shorter time";
    case Trouble::kNoisy:
      return "the symbols hardly stand out from the noise: use less gain and more light, and let nothing move";
    case Trouble::kUneven:
      return "the brightest symbols are more than 20 times as bright as the faintest: turn the object, move the "
             "projector away, coat shiny and black parts, or set exposures_us if nothing moves";
    case Trouble::kMoves:
      return "the scene moves between two frames: hold it still and measure again, or keep the exposure this short";
    case Trouble::kFlickers:
      return "the brightness flickers from frame to frame: expose for whole periods of the projector and the lamps, "
             "and check [projector] refresh_hz and [scan] power_line_hz";
    case Trouble::kClipped:
      return "symbols are clipped, by an unknown amount: set what slsctl exposure proposes, or dim the projector, and "
             "run it "
             "again";
    case Trouble::kGrain:
      return "neighbouring pixels share their noise, as compression and denoising leave it: choose an uncompressed "
             "format, and turn the camera's denoising and sharpening off";
    case Trouble::kGamma:
      return "the grey levels are not proportional to light: set the camera's gamma to 1, and turn off contrast and "
             "tone corrections";
    case Trouble::kAutomaticExposure:
      return "the brightness changes from frame to frame, and no exposure is configured: set exposure_us of this "
             "[[camera]], so that the camera does not choose it itself";
    case Trouble::kUnevenPitch:
      return "the columns of symbols are unequally wide, as if the projector scaled its picture: use its native "
             "resolution, and turn off keystone correction, zoom and overscan";
  }
  return {};
}

ExposureAdvice advise_exposure(const FrameLight& light, const std::optional<ExposureSetting>& present,
                               const ExposureLimits& limits) {
  ExposureAdvice advice;
  if (light.levels.patterned_share < kPatternedMin) {
    advice.troubles.push_back(Trouble::kNoPattern);
    return advice;
  }
  advice.brighter = wanted_change(light.levels);
  advice.look_again = light.levels.clipped_share > kClippedMax;
  find_troubles(light, advice.troubles);
  if (present) advice.setting = choose_setting(*present, limits, advice);
  return advice;
}

}  // namespace slsd
