// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/code/array.hpp"

namespace slsd {

/// Words of nine letters.
[[nodiscard]] std::int64_t word_count(int letters);

/// Words that differ from one word in at most `radius` places.
[[nodiscard]] std::int64_t ball_size(int letters, int radius);

/// Number of overlapping windows of an array.
[[nodiscard]] std::int64_t window_count(int rows, int columns);

/// The bound that forbids so many windows at this distance, in words; empty if none does. Pigeonhole (doubled with half
/// turns, without words that equal their own rotation), Singleton, Hamming.
[[nodiscard]] std::optional<std::string> forbidding_bound(const ArrayOptions& options, int minimum_distance);

/// The bound that forbids lines of letters in which no run recurs within the reach, in words; empty if none does.
/// Singleton for runs of 3, Singleton and Hamming for runs of 5 that differ in 3 letters.
/// @param cells  cells of a line: columns of a row, rows of a column
/// @param reach  in cells
[[nodiscard]] std::optional<std::string> forbidding_run_bound(int letters, int cells, int reach);

}  // namespace slsd
