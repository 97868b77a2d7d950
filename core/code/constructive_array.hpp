// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>

#include "core/code/code_array.hpp"

namespace slsd {

/// Fills the array cell by cell so that every overlapping 3x3 window keeps the distance from all before it: random
/// order of letters, backtracking within the row, rows rolled back where one cannot be filled, restarts from nothing.
/// @param options           rows and columns at least 3, letters, seed, half_turn_unique
/// @param minimum_distance  1 to 9
/// @param step_budget       letters tried before it gives up; steps and not seconds, so that every machine agrees
/// @return                  empty where the budget did not suffice
/// @thread reentrant
[[nodiscard]] std::optional<CodeArray> construct_array(const ArrayOptions& options, int minimum_distance,
                                                       std::int64_t step_budget);

}  // namespace slsd
