// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/utc_text.hpp"

#include <fmt/chrono.h>

namespace slsd {

// fmt writes fractions of a second where the time has them (or not, by its version): so each is of whole seconds.
std::string utc_text(std::chrono::system_clock::time_point time) {
  return fmt::format("{:%FT%T}Z", std::chrono::floor<std::chrono::seconds>(time));
}

std::string utc_text_ms(std::chrono::system_clock::time_point time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(time - seconds);
  return fmt::format("{:%FT%T}.{:03}Z", seconds, ms.count());
}

}  // namespace slsd
