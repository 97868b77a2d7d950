// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string_view>

namespace slsd {

/// The folder that systemd keeps for the service: the first of $STATE_DIRECTORY. Empty without that variable.
[[nodiscard]] inline std::filesystem::path state_folder() {
  const char* const variable = std::getenv("STATE_DIRECTORY");
  const std::string_view folders = variable == nullptr ? "" : variable;
  return folders.substr(0, folders.find(':'));
}

}  // namespace slsd
