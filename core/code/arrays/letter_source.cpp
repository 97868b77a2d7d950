// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/letter_source.hpp"

#include <cassert>

namespace slsd {

int LetterSource::below(int count) {
  assert(count > 0);
  const auto divisor = static_cast<std::uint32_t>(count);
  std::uint32_t draw = twister_();
  // Draws beyond the largest multiple of count would favour small numbers. The first comparison spares most divisions.
  while (draw >= -divisor && draw > ~(-divisor % divisor)) draw = twister_();
  return static_cast<int>(draw % divisor);
}

}  // namespace slsd
