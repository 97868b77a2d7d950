// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>
#include <tl/expected.hpp>

#include "clients/slsctl/client_options.hpp"

namespace slsd {

struct Failure;

// slsctl's commands. Each prints what it did and returns the exit status.

[[nodiscard]] int scan_command(const ClientOptions& options);
[[nodiscard]] int status_command(const ClientOptions& options);
[[nodiscard]] int watch_command(const ClientOptions& options);
/// Requests an image and writes it. @param method  "preview", "frame" or "pattern"
[[nodiscard]] int image_command(const ClientOptions& options, const std::string& method);

/// Makes the projector show a picture, by its name or from a file.
[[nodiscard]] int project_command(const ClientOptions& options);
/// Evaluates two frames of a camera under the pattern, and proposes exposure and gain.
[[nodiscard]] int exposure_command(const ClientOptions& options);
/// Does the same and returns JSON, for other programs than slsctl.
[[nodiscard]] tl::expected<nlohmann::json, Failure> look_at_exposure(const ClientOptions& options);
/// Reports the light in frames of a camera under the pattern, or from files, and draws it.
[[nodiscard]] int light_command(const ClientOptions& options);
/// Prints the service's metrics, or writes them to a file, whole or not at all.
[[nodiscard]] int metrics_command(const ClientOptions& options);
/// Writes the last scans that the service kept, and prints the file's name.
[[nodiscard]] int bundle_command(const ClientOptions& options);
/// Starts a calibration with the service's devices and follows it to its end; or shows, ends or cancels one.
[[nodiscard]] int calibrate_command(const ClientOptions& options);
/// Replaces this process by another program of slsd with the same command line. They are separate, so that slsctl does
/// not load libraries that only calibrating needs. @param argv  main()'s own. @return only on failure
[[nodiscard]] int separate_command(const ClientOptions& options, const std::string& program, char** argv);
/// Shows rates, latencies and states, and refreshes them.
[[nodiscard]] int top_command(const ClientOptions& options);
/// Changes keys of the service without a restart.
[[nodiscard]] int set_command(const ClientOptions& options);
/// Measures the plane on which most points of a scan lie, and makes the service subtract it.
[[nodiscard]] int plane_command(const ClientOptions& options);
/// Saves, lists, shows, uses or deletes presets.
[[nodiscard]] int preset_command(const ClientOptions& options);
/// Shows the keys that are set, and the source of each.
[[nodiscard]] int settings_command(const ClientOptions& options);
/// Scans repeatedly while the previous scan's frames are written. Ends after the requested number, after the time, or
/// at an interrupt.
[[nodiscard]] int record_command(const ClientOptions& options);

}  // namespace slsd
