// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "daemon/client/client_options.hpp"

namespace slsd {

// slsctl's commands: each prints what it did and gives the exit status.

[[nodiscard]] int scan_command(const ClientOptions& options);
[[nodiscard]] int status_command(const ClientOptions& options);
[[nodiscard]] int watch_command(const ClientOptions& options);
/// Asks for an image and writes it. @param method  "preview", "frame" or "pattern"
[[nodiscard]] int image_command(const ClientOptions& options, const std::string& method);

}  // namespace slsd
