// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/projector/x11/randr_output.hpp"

namespace slsd {

/// Chooses the projector's monitor.
/// @param wanted  its name, its EDID serial, or its place on the desktop such as "+1280+0"; empty: the monitor that is
///                not primary, or the only one
/// @param last    name of the previously chosen monitor, or empty. Without `wanted`, only that one is taken, so that
///                the pattern never moves to the operator's monitor when the projector is unplugged
/// @param enable  also take a monitor that is off, to turn it on
/// @errors kNotFound: no such monitor; kInvalidArgument: several match. The message lists the present ones
/// @thread reentrant
[[nodiscard]] Result<RandrOutput> choose_output(std::span<const RandrOutput> outputs, const std::string& wanted,
                                                const std::string& last, bool enable = false);

/// Checks that the monitor shows an image of that size pixel for pixel.
/// @errors kMismatch, with the remedy
/// @thread reentrant
[[nodiscard]] Result<> check_fit(const RandrOutput& output, int width_px, int height_px);

/// Warnings about disturbances of the monitor's light. Each is one sentence with the remedy.
/// @thread reentrant
[[nodiscard]] std::vector<std::string> output_warnings(const RandrOutput& output, std::span<const RandrOutput> outputs);

/// The projector's monitor, and the disturbances of its light.
struct MonitorReport {
  RandrOutput output;
  std::vector<std::string> warnings;  ///< see output_warnings()
};

/// Examines the monitor that a projector with these options would use. Shows nothing on it, and does not turn it on.
/// @param enable  slsd would turn the monitor on and set that size
/// @errors as list_outputs(), choose_output() and check_fit()
/// @thread thread-safe
[[nodiscard]] Result<MonitorReport> report_monitor(const std::string& wanted, int width_px, int height_px, bool enable);

/// "HDMI-1, Maker Model, serial 123, 1280x800 at 60.00 Hz, +1920+0, primary".
[[nodiscard]] std::string describe_output(const RandrOutput& output);

}  // namespace slsd
