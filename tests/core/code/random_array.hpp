// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

#include "core/code/arrays/letter_source.hpp"
#include "core/code/code_array.hpp"

namespace slsd {

/// Letters drawn at random, of which nothing is promised.
inline CodeArray random_array(int rows, int columns, int letters, std::uint32_t seed) {
  LetterSource source(seed);
  CodeArray array{rows, columns, letters, {}};
  for (int i = 0; i < rows * columns; ++i) array.cells.push_back(static_cast<std::uint8_t>(source.below(letters)));
  return array;
}

}  // namespace slsd
