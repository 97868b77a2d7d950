// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>

namespace slsd::web {

/// The program that listens at a TCP port of this machine, such as "slsd-web (process 1234)"; nothing if it is not
/// visible.
[[nodiscard]] std::optional<std::string> port_holder(int port);

}  // namespace slsd::web
