// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

namespace slsd {

/// The known key that takes the fewest insertions, deletions and replacements of a letter to reach from `key`; the
/// first of equals.
/// @param known  at least one
/// @thread reentrant
[[nodiscard]] std::string_view nearest_key(std::string_view key, std::span<const std::string_view> known);

}  // namespace slsd
