// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <vector>

namespace slsd {

/// The middle of the values, the upper one of two; 0 of none.
/// @thread reentrant
[[nodiscard]] inline double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace slsd
