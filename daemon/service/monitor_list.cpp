// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/service/monitor_list.hpp"

#include "drivers/projector/x11/choose_output.hpp"

namespace slsd {

std::string MonitorList::text() const {
  if (!outputs_) return "no monitor: " + outputs_.error().message + "\n";
  if (outputs_->empty()) return "no monitor is plugged in and lit\n";
  std::string text;
  for (const RandrOutput& output : *outputs_) text += "monitor " + describe_output(output) + "\n";
  return text;
}

nlohmann::json MonitorList::json() const {
  nlohmann::json monitors = nlohmann::json::array();
  if (!outputs_) return monitors;
  for (const RandrOutput& output : *outputs_) {
    monitors.push_back({{"name", output.name},
                        {"model", output.model},
                        {"serial", output.serial},
                        {"x_px", output.area.x_px},
                        {"y_px", output.area.y_px},
                        {"width_px", output.area.width_px},
                        {"height_px", output.area.height_px},
                        {"refresh_hz", output.refresh_hz},
                        {"primary", output.primary}});
  }
  return monitors;
}

}  // namespace slsd
