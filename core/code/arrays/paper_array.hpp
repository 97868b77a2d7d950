// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/code/array.hpp"

namespace slsd {

/// Draws whole arrays until all aligned 3x3 windows of one differ pairwise. Elahi et al. 2020, section II.B.2 and
/// figure 2.
/// @param rows, columns  at least 3
/// @param draws          number of arrays to draw before it gives up
/// @return               the first array that passes; empty if none does
/// @thread reentrant
[[nodiscard]] std::optional<CodeArray> draw_paper_array(int rows, int columns, int letters, std::uint32_t seed,
                                                        int draws);

/// Tells whether the aligned, non-overlapping 3x3 windows of an array differ pairwise, which is all that the paper's
/// method promises.
/// @thread reentrant
[[nodiscard]] bool aligned_windows_differ(const CodeArray& array);

}  // namespace slsd
