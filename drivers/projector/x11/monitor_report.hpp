// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/projector/x11/randr_output.hpp"

namespace slsd {

/// The monitor that is the projector, and what disturbs its light.
struct MonitorReport {
  RandrOutput output;
  std::vector<std::string> warnings;  ///< as output_warnings() says
};

/// Looks at the monitor that a projector with these options takes; shows nothing on it.
/// @errors as list_outputs(), choose_output() and check_fit()
/// @thread thread-safe
[[nodiscard]] Result<MonitorReport> report_monitor(const std::string& wanted, int width_px, int height_px);

}  // namespace slsd
