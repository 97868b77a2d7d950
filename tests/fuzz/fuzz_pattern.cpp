// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/code/pattern.hpp"

// Whatever is read must be a pattern that can be written, read again and drawn.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto pattern = slsd::read_pattern({reinterpret_cast<const char*>(bytes), size}, "pattern.toml");
  if (!pattern) return 0;
  const auto again = slsd::read_pattern(slsd::write_pattern(*pattern), "pattern.toml");
  if (!again || again->array != pattern->array || slsd::draw_pattern(*pattern).empty()) std::abort();
  return 0;
}
