// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "docs/tables/array_tables.hpp"

namespace slsd {

/// Draws the profiles as lines: share of pairs over distance, logarithmic, from 0.001 % to 100 %.
/// @return false where the file cannot be written
[[nodiscard]] bool write_profile_chart(const std::vector<NamedProfile>& profiles, const std::string& file);

}  // namespace slsd
