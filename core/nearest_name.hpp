// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace slsd {

/// Counts the characters to insert, delete or replace to turn one word into the other (Levenshtein).
/// @thread reentrant
[[nodiscard]] int edit_distance(std::string_view a, std::string_view b);

/// The name that a user most likely meant by a word: the nearest within a third of its length, or else the only one
/// that begins with it. Empty if there is none.
/// @thread reentrant
[[nodiscard]] std::optional<std::string> nearest_name(std::string_view word, std::span<const std::string> names);

/// "; did you mean symbols?", or empty if no name is near.
[[nodiscard]] std::string nearest_hint(std::string_view word, std::span<const std::string> names);

}  // namespace slsd
