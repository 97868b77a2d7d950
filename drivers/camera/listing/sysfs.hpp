// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace slsd {

/// The first line of a file; empty where it cannot be read.
[[nodiscard]] std::string first_line(const std::filesystem::path& file);

/// The whole number that the first line begins with.
[[nodiscard]] std::optional<int> first_number(const std::filesystem::path& file);

/// What is in a folder, sorted; nothing where it cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder);

}  // namespace slsd
