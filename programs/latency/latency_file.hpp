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

/// The default file of the latencies: "latency.toml" beside the calibration, or beside the configuration if no
/// calibration is configured.
[[nodiscard]] std::filesystem::path latency_file(const Configuration& configuration,
                                                 const std::filesystem::path& configuration_file);

/// A projector's name in the report, "glfw HDMI-1". @thread reentrant
[[nodiscard]] std::string projector_name(const std::string& driver, const std::string& monitor);

/// Warnings about settings that do not suit the measured latencies, one sentence each. Examples: a too short [scan]
/// projector_latency_ms, unmeasured or overexposed cameras, another projector. Empty if all is well.
/// @param projector  the one in use, from projector_name(); empty if unknown
/// @thread reentrant
[[nodiscard]] std::vector<std::string> latency_warnings(const Configuration& configuration, const LatencyReport& report,
                                                        const std::string& projector);

/// Writes the report as TOML. @thread reentrant
[[nodiscard]] std::string write_latency(const LatencyReport& report);
/// @errors kMalformed, kInvalidArgument: the place is file:line:column @thread reentrant
[[nodiscard]] Result<LatencyReport> read_latency(std::string_view text, const std::filesystem::path& file);

}  // namespace slsd
