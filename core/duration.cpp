// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/duration.hpp"

#include <algorithm>
#include <cstddef>

namespace slsd {

void Duration::add(std::chrono::nanoseconds time) {
  const double seconds = std::chrono::duration<double>(time).count();
  ++buckets[static_cast<std::size_t>(std::ranges::lower_bound(kDurationBounds, seconds) - kDurationBounds.begin())];
  last = time;
  total += time;
  longest = std::max(longest, time);
  ++count;
}

}  // namespace slsd
