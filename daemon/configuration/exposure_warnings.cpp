// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/exposure_warnings.hpp"

#include <vector>

#include <fmt/format.h>

#include "core/exposure/light_periods.hpp"

namespace slsd {
namespace {

std::string misfits(const ExposureFit& fit, const LightPeriods& periods) {
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

std::vector<std::string> exposure_warnings(const Configuration& configuration) {
  const LightPeriods periods{.refresh_hz = configuration.projector.refresh_hz,
                             .power_line_hz = static_cast<double>(configuration.scan.power_line_hz)};
  std::vector<std::string> warnings;
  for (const CameraOptions& camera : configuration.cameras) {
    const bool several = !camera.exposures_us.empty() && !camera.replays();
    const std::vector<double> exposures_us =
        several ? camera.exposures_us : std::vector{camera.exposure_us().value_or(0)};
    for (const double exposure_us : exposures_us) {
      if (exposure_us <= 0) continue;
      const ExposureFit fit = fit_exposure(exposure_us, periods);
      if (fit.fits()) continue;
      warnings.push_back(fmt::format(
          "camera \"{}\": {} {:g} is not a whole multiple of {}, so frames differ in brightness: {}", camera.name(),
          several ? "of exposures_us," : "exposure_us =", exposure_us, misfits(fit, periods), nearest(fit)));
    }
  }
  return warnings;
}

}  // namespace slsd
