// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// The error for a failed system call on a file.
/// @param error_number  errno
/// @param doing         what was tried, as in "cannot read"
/// @thread reentrant
[[nodiscard]] Error system_error(int error_number, std::string_view doing, const std::filesystem::path& path);

}  // namespace slsd
