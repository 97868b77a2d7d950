// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>
#include <tl/expected.hpp>

#include "clients/slsctl/client_options.hpp"

namespace slsd {

struct Failure;

// slsctl's commands: each prints what it did and gives the exit status.

[[nodiscard]] int scan_command(const ClientOptions& options);
[[nodiscard]] int status_command(const ClientOptions& options);
[[nodiscard]] int watch_command(const ClientOptions& options);
/// Asks for an image and writes it. @param method  "preview", "frame" or "pattern"
[[nodiscard]] int image_command(const ClientOptions& options, const std::string& method);

/// Has the projector show a picture, by its name or from a file.
[[nodiscard]] int project_command(const ClientOptions& options);
/// Looks at two frames of a camera while the pattern is shown, and proposes exposure and gain.
[[nodiscard]] int exposure_command(const ClientOptions& options);
/// The same as JSON, for others than slsctl.
[[nodiscard]] tl::expected<nlohmann::json, Failure> look_at_exposure(const ClientOptions& options);
/// Prints the service's metrics, or writes them to a file, whole or not at all.
[[nodiscard]] int metrics_command(const ClientOptions& options);
/// Writes the last scans that the service kept, and prints the file's name.
[[nodiscard]] int bundle_command(const ClientOptions& options);
/// Begins a calibration with the service's devices and shows it to its end, or looks at, ends or cancels one.
[[nodiscard]] int calibrate_command(const ClientOptions& options);
/// Shows rates, latencies and states, again and again.
[[nodiscard]] int top_command(const ClientOptions& options);
/// Sets keys of the service without a restart.
[[nodiscard]] int set_command(const ClientOptions& options);
/// Shows the keys that are given, and where each is from.
[[nodiscard]] int settings_command(const ClientOptions& options);
/// Scans on and on, each while the frames of the one before are written, until as many as asked for are
/// there, the time is over, or an interrupt comes.
[[nodiscard]] int record_command(const ClientOptions& options);

}  // namespace slsd
