// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string_view>

#include <tl/expected.hpp>

#include "daemon/client/report.hpp"

namespace slsd {

/// Writes a file, whole or not at all. One that cannot be written is a failed request, never a missing service.
[[nodiscard]] tl::expected<void, Failure> write_output(const std::filesystem::path& file, std::string_view bytes);

}  // namespace slsd
