// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/cloud/cloud.hpp"
#include "core/result.hpp"

namespace slsd {

/// Binary little-endian PLY, as docs/formats.md says.
[[nodiscard]] std::string write_ply(const Cloud& cloud);

/// Reads back what write_ply wrote (and only that).
/// @errors kMalformed
[[nodiscard]] Result<Cloud> read_ply(std::string_view bytes, std::string_view name);

}  // namespace slsd
