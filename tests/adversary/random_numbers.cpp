// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/random_numbers.hpp"

namespace slsd::adversary {

std::vector<float> noise_table() {
  std::vector<float> noise;
  Random random(7);
  for (std::uint32_t i = 0; i < kNoiseTable; ++i) {
    double sum = 0;
    for (int j = 0; j < 6; ++j) sum += uniform(random, -1, 1);
    noise.push_back(static_cast<float>(sum / std::sqrt(2.)));
  }
  return noise;
}

}  // namespace slsd::adversary
