// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

namespace slsd {

/// The upper bounds of a Duration's histogram buckets, in seconds. One more bucket follows the last bound.
inline constexpr std::array kDurationBounds{0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05,
                                            0.1,    0.2,   0.5,   1.0,   2.0,  5.0};

[[nodiscard]] inline double in_ms(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

/// The times that one activity took: the last, the mean, the maximum, and a histogram.
struct Duration {
  std::chrono::nanoseconds last{};
  std::chrono::nanoseconds total{};
  std::chrono::nanoseconds longest{};
  std::uint64_t count = 0;
  std::array<std::uint64_t, kDurationBounds.size() + 1> buckets{};

  void add(std::chrono::nanoseconds time);
  [[nodiscard]] std::chrono::nanoseconds mean() const {
    return count == 0 ? total : total / static_cast<std::int64_t>(count);
  }
};

}  // namespace slsd
