// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <ranges>
#include <span>
#include <type_traits>
#include <vector>

namespace slsd {

/// The median of the values, the upper one of an even number; 0 without values. Reorders the values.
/// @param number_of  the number in a value, if values are more than numbers
/// @thread           reentrant
template <std::ranges::random_access_range Values, class NumberOf = std::identity>
[[nodiscard]] auto median_in_place(Values&& values, NumberOf number_of = {}) {
  using Number = std::decay_t<std::invoke_result_t<NumberOf&, std::ranges::range_reference_t<Values>>>;
  if (std::ranges::empty(values)) return Number(0);
  constexpr int kFew = 16;  // insertion sort up to this size
  const auto middle = std::ranges::begin(values) + std::ranges::ssize(values) / 2;
  if (std::ranges::ssize(values) <= kFew) {
    std::ranges::sort(values, {}, number_of);
  } else {
    std::ranges::nth_element(values, middle, {}, number_of);
  }
  return Number(std::invoke(number_of, *middle));
}
[[nodiscard]] inline double median_of(std::vector<double> values) {
  return median_in_place(values);
}

/// Usual value: the median of at most a thousand values, evenly sampled.
/// @param value_at  gives the value at a place, 0 to count - 1
/// @thread reentrant
template <class ValueAt>
[[nodiscard]] float usual_of(std::size_t count, ValueAt&& value_at) {
  constexpr std::size_t kSamples = 1000;
  std::array<float, kSamples> sample;
  const std::size_t stride = (count + kSamples - 1) / kSamples;
  std::size_t taken = 0;
  for (std::size_t place = 0; place < count; place += stride) sample[taken++] = value_at(place);
  return median_in_place(std::span(sample).first(taken));
}

/// Ratio of a normal distribution's standard deviation to the median of its absolute values.
inline constexpr double kSigmaOfMedian = 1.4826;

/// Weight of a value at a distance, 1 to 0: a quarter at the scale, almost nothing far beyond it.
[[nodiscard]] inline double robust_weight(double off, double scale) {
  const double ratio = off / scale, by = 1 + ratio * ratio;
  return 1 / (by * by);
}

}  // namespace slsd
