// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>

#include "drivers/camera/frame.hpp"

namespace slsd::test {

/// A deadline that only what hangs for good misses.
inline MonotonicTime soon() {
  return std::chrono::steady_clock::now() + std::chrono::seconds(60);
}

}  // namespace slsd::test
