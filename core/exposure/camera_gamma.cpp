// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/camera_gamma.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace slsd {
namespace {

constexpr double kDarkest = 0.06;  // of full: below, the camera's black level decides
constexpr std::size_t kLevelsMin = 8;
constexpr double kSpanMin = 3;        // from the darkest level to the brightest
constexpr double kModelError = 0.02;  // of a variance: no sensor keeps to the model exactly
constexpr double kMisfitMax = 2.5;    // mean square of the residuals, in standard deviations
constexpr double kSensorMax = 0.1;    // sensor's noise, of that of photons at full level: 8 electrons of 640
constexpr double kSensorRules = 2;    // sensor's noise, of that of photons at full level: hardly rises with the light
constexpr double kBlackMax = 0.03;    // black level, of full: it makes the sensor's noise appear smaller, or negative
constexpr double kWidthMax = 0.4;
constexpr double kGammaMin = 0.3, kGammaMax = 1.2, kGammaStep = 0.01;

struct Measured {
  double level, variance, weight;  // level: share of full
};

/// Number of correlated pixels that tell as much as one independent one. Noise blurred by a Gaussian s has a
/// correlation of exp(-d^2 / 4 s^2) at the distance d.
double pixels_of_one(const NoiseBetween& noise) {
  const double neighbours = std::clamp(noise.neighbours.value_or(0), 0.0, 0.95);
  return neighbours < 0.05 ? 1 : std::max(1.0, -std::numbers::pi / (2 * std::log(neighbours)));
}

std::vector<Measured> usable(const NoiseBetween& noise, double full) {
  std::vector<Measured> usable;
  const double of_one = pixels_of_one(noise);
  for (const LevelNoise& at : noise.levels) {
    if (at.level < kDarkest * full || !(at.variance > 0)) continue;
    const double error = std::sqrt(2 * of_one / static_cast<double>(at.pixels) + kModelError * kModelError);
    usable.push_back({at.level / full, at.variance, 1 / std::pow(error * at.variance, 2)});
  }
  return usable;
}

/// The noise of a camera with this gamma: variances at full level, and the sum of the squared residuals in standard
/// deviations. Infinite if noise would fall with the light.
struct NoiseFit {
  double sensor = 0, photons = 0;
  double misfit = std::numeric_limits<double>::infinity();
};

/// @param sensor_max  of the photons' noise
NoiseFit fit_noise(const std::vector<Measured>& measured, double gamma, double sensor_max) {
  double aa = 0, ab = 0, bb = 0, av = 0, bv = 0, vv = 0;
  for (const Measured& at : measured) {
    const double light = std::pow(at.level, 1 / gamma);
    const double sensor = std::pow(gamma * std::pow(light, gamma - 1), 2), photons = sensor * light;
    aa += at.weight * sensor * sensor, ab += at.weight * sensor * photons, bb += at.weight * photons * photons;
    av += at.weight * sensor * at.variance, bv += at.weight * photons * at.variance;
    vv += at.weight * at.variance * at.variance;
  }
  const double determinant = aa * bb - ab * ab;
  NoiseFit fit{(bb * av - ab * bv) / determinant, (aa * bv - ab * av) / determinant};
  if (!(determinant > 0) || !(fit.photons > 0)) return {};
  const double found = fit.sensor / fit.photons, ratio = std::clamp(found, -kBlackMax, sensor_max);
  if (ratio != found) {
    fit.photons = (ratio * av + bv) / (ratio * ratio * aa + 2 * ratio * ab + bb);
    fit.sensor = ratio * fit.photons;
  }
  fit.misfit = vv - 2 * (fit.sensor * av + fit.photons * bv) + fit.sensor * fit.sensor * aa +
               2 * fit.sensor * fit.photons * ab + fit.photons * fit.photons * bb;
  return fit;
}

double misfit_of(const std::vector<Measured>& measured, double gamma) {
  return fit_noise(measured, gamma, kSensorMax).misfit;
}

/// Tells whether the noise may be the sensor's own, whose variance is the same at all levels. With a gamma of 0.5,
/// photon noise is so, too.
bool may_be_of_the_sensor(const std::vector<Measured>& measured, double likely) {
  double weight = 0, sum = 0, squares = 0;
  for (const Measured& at : measured)
    weight += at.weight, sum += at.weight * at.variance, squares += at.weight * at.variance * at.variance;
  if (squares - sum * sum / weight <= likely) return true;
  const NoiseFit linear = fit_noise(measured, 1, std::numeric_limits<double>::infinity());
  return linear.misfit <= likely && linear.sensor > kSensorRules * linear.photons;
}

}  // namespace

std::optional<CameraGamma> estimate_gamma(const NoiseBetween& noise, double full) {
  const std::vector<Measured> measured = usable(noise, full);
  if (measured.size() < kLevelsMin || measured.back().level < kSpanMin * measured.front().level) return std::nullopt;
  CameraGamma estimate;
  double least = std::numeric_limits<double>::infinity();
  for (double gamma = kGammaMin; gamma <= kGammaMax; gamma += kGammaStep) {
    const double misfit = misfit_of(measured, gamma);
    if (misfit < least) least = misfit, estimate.likeliest = gamma;
  }
  const auto free = static_cast<double>(measured.size() - 3);
  if (!(least <= kMisfitMax * free)) return std::nullopt;
  const double likely = least + 4 * std::max(1.0, least / free);
  if (may_be_of_the_sensor(measured, likely)) return std::nullopt;
  estimate.low = kGammaMax, estimate.high = kGammaMin;
  for (double gamma = kGammaMin; gamma <= kGammaMax; gamma += kGammaStep) {
    if (misfit_of(measured, gamma) > likely) continue;
    estimate.low = std::min(estimate.low, gamma), estimate.high = std::max(estimate.high, gamma);
  }
  if (estimate.high - estimate.low > kWidthMax) return std::nullopt;
  return estimate;
}

}  // namespace slsd
