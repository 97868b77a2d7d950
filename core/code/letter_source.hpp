// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <random>

namespace slsd {

/// Letters from the Mersenne Twister. std::mt19937 gives the same numbers everywhere, but the standard distributions do
/// not, so this class has its own.
/// @thread thread-bound
class LetterSource {
 public:
  explicit LetterSource(std::uint32_t seed) : twister_(seed) {}

  /// A uniform number from 0 to count - 1.
  [[nodiscard]] int below(int count);

 private:
  std::mt19937 twister_;
};

}  // namespace slsd
