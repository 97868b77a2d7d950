// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "daemon/configuration/configuration.hpp"

namespace slsd::test {

/// Reads a text as the file etc/slsd.toml.
[[nodiscard]] inline Result<Configuration> read(const std::string& text) {
  return read_configuration(text, "etc/slsd.toml");
}

/// The error of reading it; empty where there is none.
[[nodiscard]] inline std::string error_of(const std::string& text) {
  const auto configuration = read(text);
  return configuration ? "" : to_string(configuration.error());
}

}  // namespace slsd::test
