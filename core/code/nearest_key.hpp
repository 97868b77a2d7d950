// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

namespace slsd {

/// The known key with the fewest insertions, deletions and replacements of a letter from `key`; the first on a tie.
/// @param known  at least one
/// @thread reentrant
[[nodiscard]] std::string_view nearest_key(std::string_view key, std::span<const std::string_view> known);

}  // namespace slsd
