// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>

#include "core/code/array.hpp"

namespace slsd {

/// Distance within which no run of letters recurs in its line (core/code/arrays/runs.hpp); 0: runs may recur anywhere.
/// A reach beyond the end of the line covers the whole line.
struct RunReach {
  int along_rows = 0;     ///< columns
  int along_columns = 0;  ///< rows

  friend bool operator==(const RunReach&, const RunReach&) = default;
};

/// Fills the array cell by cell. Every overlapping 3x3 window keeps the distance from all earlier ones, and no run
/// recurs within its reach. The search takes letters in random order and backtracks within the row. If it cannot fill a
/// row, it removes rows, and at last restarts. If columns have the longer reach, it fills column by column.
/// @param options           rows and columns at least 3, letters, seed, half_turn_unique
/// @param minimum_distance  1 to 9
/// @param reach             0 or more columns and rows
/// @param step_budget       number of letters tried before it gives up; steps instead of seconds, so that all machines
///                          agree
/// @return                  empty if the budget did not suffice
/// @thread reentrant
[[nodiscard]] std::optional<CodeArray> construct_array(const ArrayOptions& options, int minimum_distance,
                                                       RunReach reach, std::int64_t step_budget);

}  // namespace slsd
