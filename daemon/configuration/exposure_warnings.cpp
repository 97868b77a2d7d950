// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/exposure_warnings.hpp"

#include <vector>

#include <fmt/format.h>

#include "core/exposure/light_periods.hpp"

namespace slsd {

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
      const std::string misfit = exposure_misfit(exposure_us, periods);
      if (misfit.empty()) continue;
      warnings.push_back(fmt::format("camera \"{}\": {} {:g} {}", camera.name(),
                                     several ? "of exposures_us," : "exposure_us =", exposure_us, misfit));
    }
  }
  return warnings;
}

}  // namespace slsd
