// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "programs/latency/measure_latency.hpp"

namespace slsd {

/// The latencies that slsd --calibrate --latency writes.
struct LatencyReport {
  std::string date;       ///< ISO 8601, UTC
  std::string projector;  ///< see projector_name()
  std::vector<CameraLatency> cameras;
};

/// The default file of the latencies: "latency.toml" beside the calibration. Without a configured calibration it is
/// beside the configuration.
[[nodiscard]] std::filesystem::path latency_file(const Configuration& configuration,
                                                 const std::filesystem::path& configuration_file);

/// A projector as the report names it, "glfw HDMI-1". @thread reentrant
[[nodiscard]] std::string projector_name(const std::string& driver, const std::string& monitor);

/// Warnings about what does not suit the measured latencies, one sentence each. Examples are a [scan]
/// projector_latency_ms that is too short, cameras that were not measured or were overexposed, and another projector.
/// Empty if all is well.
/// @param projector  the one in use, as projector_name(); empty where that cannot be told
/// @thread reentrant
[[nodiscard]] std::vector<std::string> latency_warnings(const Configuration& configuration, const LatencyReport& report,
                                                        const std::string& projector);

/// Writes the report as TOML. @thread reentrant
[[nodiscard]] std::string write_latency(const LatencyReport& report);
/// @errors kMalformed, kInvalidArgument: the place is file:line:column @thread reentrant
[[nodiscard]] Result<LatencyReport> read_latency(std::string_view text, const std::filesystem::path& file);

}  // namespace slsd
