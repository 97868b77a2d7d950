// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/code/array.hpp"

namespace slsd {

/// A run is 3, 4 or 5 consecutive letters along a row or a column. It recurs if another run of the same line is equal
/// (3 letters), differs in at most one letter (4) or in at most two (5).
inline constexpr int kShortestRun = 3;
inline constexpr int kLongestRun = 5;

enum class Along { kRows, kColumns };

/// The smallest distance at which a run recurs in its line, by plain comparison of all pairs.
/// @param length  length of the runs, 3 to 5 letters
/// @return        columns along rows, rows along columns; empty if no run recurs
/// @thread        reentrant
[[nodiscard]] std::optional<int> nearest_recurrence(const CodeArray& array, Along along, int length);

/// The largest distance, in columns or rows, up to which no run of any length recurs; the whole line if none ever does.
/// By plain comparison of all pairs.
/// @thread reentrant
[[nodiscard]] int repeat_free_reach(const CodeArray& array, Along along);

/// Share of the runs that recur within a distance, on either side in the same line.
/// @param length  length of the runs, 3 to 5 letters
/// @param within  columns along rows, rows along columns
/// @return        0 to 1
/// @thread        reentrant
[[nodiscard]] double recurring_share(const CodeArray& array, Along along, int length, int within);

}  // namespace slsd
