// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/letter_source.hpp"

#include <cassert>

namespace slsd {

int LetterSource::below(int count) {
  assert(count > 0);
  const std::uint64_t range = std::uint64_t{1} << 32;
  const std::uint64_t limit = range - range % static_cast<std::uint64_t>(count);
  std::uint64_t draw = twister_();
  while (draw >= limit) draw = twister_();
  return static_cast<int>(draw % static_cast<std::uint64_t>(count));
}

}  // namespace slsd
