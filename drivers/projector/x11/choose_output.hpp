// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/projector/x11/randr_output.hpp"

namespace slsd {

/// Chooses the monitor that is the projector.
/// @param wanted  its name, its EDID serial, or its place on the desktop as in "+1280+0"; empty: the one that is not
/// the
///                primary, and where there is only one, that
/// @param last    name of the monitor that was chosen before, empty where none was: without a wish only that will do,
///                lest the pattern moves to the operator's monitor when the projector is unplugged
/// @param enable  take one that is off, too, to turn it on
/// @errors kNotFound: no such monitor; kInvalidArgument: several could be meant. The message lists those that are there
/// @thread reentrant
[[nodiscard]] Result<RandrOutput> choose_output(std::span<const RandrOutput> outputs, const std::string& wanted,
                                                const std::string& last, bool enable = false);

/// Checks that the monitor shows an image of that size pixel for pixel.
/// @errors kMismatch, with the remedy
/// @thread reentrant
[[nodiscard]] Result<> check_fit(const RandrOutput& output, int width_px, int height_px);

/// Warnings about disturbances of that monitor's light. Each is one sentence with the remedy.
/// @thread reentrant
[[nodiscard]] std::vector<std::string> output_warnings(const RandrOutput& output, std::span<const RandrOutput> outputs);

/// The monitor that is the projector, and what disturbs its light.
struct MonitorReport {
  RandrOutput output;
  std::vector<std::string> warnings;  ///< see output_warnings()
};

/// Looks at the monitor that a projector with these options takes; shows nothing on it, and leaves one that is off.
/// @param enable  slsd would turn it on, and set it to that size
/// @errors as list_outputs(), choose_output() and check_fit()
/// @thread thread-safe
[[nodiscard]] Result<MonitorReport> report_monitor(const std::string& wanted, int width_px, int height_px, bool enable);

/// "HDMI-1, Maker Model, serial 123, 1280x800 at 60.00 Hz, +1920+0, primary".
[[nodiscard]] std::string describe_output(const RandrOutput& output);

}  // namespace slsd
