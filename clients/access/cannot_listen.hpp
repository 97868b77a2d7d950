// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <system_error>

#include "core/result.hpp"

namespace slsd {

/// Explains why a TCP port cannot be listened at. For a port in use, names the program there if it is visible:
/// "slsd-web (process 1234)".
[[nodiscard]] Error cannot_listen(const std::string& address, int port, const std::error_code& error);

}  // namespace slsd
