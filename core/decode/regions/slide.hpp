// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Replaces each value by the best of the next `length` values, by doubling: windows of one, two, four, and at last two
/// overlapping windows. The last values, with fewer after them, stay incomplete.
template <class T, class Better>
inline __attribute__((always_inline)) void slide(T* values, int count, int length, Better better) {
  int window = 1;
  const auto combine = [&](int step) {
#pragma omp simd
    for (int x = 0; x < count - step; ++x) values[x] = better(values[x], values[x + step]);
  };
  for (; 2 * window <= length; window *= 2) combine(window);
  if (window < length) combine(length - window);
}

template <class T>
inline __attribute__((always_inline)) void slide_least(T* values, int count, int length) {
  slide(values, count, length, [](T a, T b) { return a < b ? a : b; });
}

template <class T>
inline __attribute__((always_inline)) void slide_greatest(T* values, int count, int length) {
  slide(values, count, length, [](T a, T b) { return a > b ? a : b; });
}

}  // namespace slsd
