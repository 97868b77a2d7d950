// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/light_periods.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace slsd {
namespace {

constexpr double kVariationMax = 0.01;
constexpr double kLongestUs = 1e6;
constexpr double kShortestPeriodUs = 100.0;

bool whole_periods(double exposure_us, double period_us) {
  if (period_us <= 0) return true;
  const double periods = std::round(exposure_us / period_us);
  return periods >= 1 && std::abs(exposure_us - periods * period_us) <= kVariationMax * exposure_us;
}

std::string misfits_of(const ExposureFit& fit, const LightPeriods& periods) {
  std::string text;
  if (!fit.projector) {
    text += fmt::format("a projector frame ({:.0f} us at {:g} Hz)", periods.projector_us(), periods.refresh_hz);
  }
  if (!fit.lamps) {
    text += fmt::format("{}half a lamp period ({:.0f} us at {} Hz)", text.empty() ? "" : ", nor of ",
                        periods.lamps_us(), periods.power_line_hz);
  }
  return text;
}

std::string nearest(const ExposureFit& fit) {
  if (!fit.shorter_us && !fit.longer_us) return "no exposure up to a second suits both: shade the lamps";
  if (!fit.shorter_us) return fmt::format("set {:.0f}", *fit.longer_us);
  if (!fit.longer_us) return fmt::format("set {:.0f}", *fit.shorter_us);
  return fmt::format("set {:.0f} or {:.0f}", *fit.shorter_us, *fit.longer_us);
}

}  // namespace

ExposureFit fit_exposure(double exposure_us, const LightPeriods& periods) {
  ExposureFit fit;
  fit.projector = whole_periods(exposure_us, periods.projector_us());
  fit.lamps = whole_periods(exposure_us, periods.lamps_us());
  if (fit.fits()) return fit;
  for (const double fitting_us : fitting_exposures(periods, kLongestUs)) {
    if (fitting_us < exposure_us) fit.shorter_us = fitting_us;
    if (fitting_us > exposure_us && !fit.longer_us) fit.longer_us = fitting_us;
  }
  return fit;
}

std::string exposure_misfit(double exposure_us, const LightPeriods& periods) {
  const ExposureFit fit = fit_exposure(exposure_us, periods);
  if (fit.fits()) return {};
  return fmt::format("is not a whole multiple of {}, so frames differ in brightness: {}", misfits_of(fit, periods),
                     nearest(fit));
}

std::vector<double> fitting_exposures(const LightPeriods& periods, double longest_us) {
  const double step_us = periods.projector_us() > 0 ? periods.projector_us() : periods.lamps_us();
  std::vector<double> exposures;
  if (step_us < kShortestPeriodUs) return exposures;
  for (double exposure_us = step_us; exposure_us <= longest_us * (1 + kVariationMax); exposure_us += step_us) {
    if (whole_periods(exposure_us, periods.lamps_us())) exposures.push_back(exposure_us);
  }
  return exposures;
}

}  // namespace slsd
