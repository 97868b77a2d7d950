// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/cloud/cloud.hpp"
#include "core/result.hpp"

namespace slsd {

/// Writes binary little-endian PLY as in docs/formats.md.
[[nodiscard]] std::string write_ply(const Cloud& cloud);

/// Reads the output of write_ply, and no other PLY.
/// @errors kMalformed
[[nodiscard]] Result<Cloud> read_ply(std::string_view bytes, std::string_view name);

}  // namespace slsd
