// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/code/array.hpp"
#include "core/result.hpp"

namespace slsd {

/// Makes the array and checks it; the same options give the same array on every machine.
/// @errors kInvalidArgument; kImpossible with the bound that forbids it
/// @thread reentrant
[[nodiscard]] Result<CodeArray> make_code_array(const ArrayOptions& options);

/// Rows or columns of the array for a projector's extent: rounded up to an integer, then to a multiple of three.
/// Elahi et al. 2020, equations (1) and (2).
[[nodiscard]] int array_extent(int projector_px, int symbol_size_px, int spacing_px);

/// The smallest Hamming distance between any two overlapping 3x3 windows, by plain comparison of all pairs. With
/// half_turn, it includes all pairs of a window and a rotated window.
[[nodiscard]] int minimum_window_distance(const CodeArray& array, bool half_turn = false);

}  // namespace slsd
