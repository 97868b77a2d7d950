// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/result.hpp"
#include "drivers/projector/x11/randr_output.hpp"

namespace slsd {

/// The monitors of the X server that DISPLAY names.
/// @thread reentrant
class MonitorList {
 public:
  [[nodiscard]] static MonitorList look() { return MonitorList(list_outputs()); }
  explicit MonitorList(Result<std::vector<RandrOutput>> outputs) : outputs_(std::move(outputs)) {}

  /// For people: a line to a monitor; where there is none, why.
  [[nodiscard]] std::string text() const;
  /// An array of monitors, as slsd(8) says.
  [[nodiscard]] nlohmann::json json() const;

 private:
  Result<std::vector<RandrOutput>> outputs_;
};

}  // namespace slsd
