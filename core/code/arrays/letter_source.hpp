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
  // std::mt19937, but its words have 32 bits on all machines: twice as many fit into a vector.
  std::mersenne_twister_engine<std::uint32_t, 32, 624, 397, 31, 0x9908b0df, 11, 0xffffffff, 7, 0x9d2c5680, 15,
                               0xefc60000, 18, 1812433253>
      twister_;
};

}  // namespace slsd
