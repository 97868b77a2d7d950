// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <random>
#include <vector>

namespace slsd::adversary {

using Random = std::mt19937;

/// Draws numbers that are the same on every machine, which those of std's distributions are not.
inline double uniform(Random& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
}
inline int whole(Random& random, int low, int high) {
  return low + static_cast<int>(random() % static_cast<std::uint32_t>(high - low + 1));
}
/// Draws from a range of magnitudes: each doubling is as likely as the next.
inline double log_uniform(Random& random, double low, double high) {
  return low * std::exp(uniform(random, 0, std::log(high / low)));
}
inline double either_sign(Random& random, double value) {
  return whole(random, 0, 1) == 0 ? value : -value;
}

/// The number of entries is a power of two.
inline constexpr std::uint32_t kNoiseTable = 1U << 18U;

/// Noise of variance 1, nearly Gaussian.
[[nodiscard]] std::vector<float> noise_table();

}  // namespace slsd::adversary
