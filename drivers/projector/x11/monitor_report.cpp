// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/monitor_report.hpp"

#include "drivers/projector/x11/choose_output.hpp"

namespace slsd {

Result<MonitorReport> report_monitor(const std::string& wanted, int width_px, int height_px) {
  const auto outputs = list_outputs();
  if (!outputs) return tl::unexpected(outputs.error());
  auto output = choose_output(*outputs, wanted, {});
  if (!output) return tl::unexpected(output.error());
  if (auto fits = check_fit(*output, width_px, height_px); !fits) return tl::unexpected(fits.error());
  auto warnings = output_warnings(*output, *outputs);
  return MonitorReport{std::move(*output), std::move(warnings)};
}

}  // namespace slsd
