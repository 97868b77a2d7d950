// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/files/picture_process.hpp"

// What a client sends, and what the process that decodes it answers: both are a stranger's.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  constexpr int kWidthPx = 9, kHeightPx = 7;
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const auto decoded = slsd::decode_projected(text, kWidthPx, kHeightPx);
  if (slsd::read_answer(slsd::answer_text(decoded), kWidthPx, kHeightPx).has_value() != decoded.has_value())
    std::abort();
  const auto answered = slsd::read_answer(text, kWidthPx, kHeightPx);
  if (answered && (answered->width() != kWidthPx || answered->height() != kHeightPx)) std::abort();
  if (!answered && answered.error().message.empty()) std::abort();
  return 0;
}
