// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <functional>
#include <thread>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// The source of time: the host's clock, or a test's own.
struct Timepiece {
  std::function<MonotonicTime()> now = [] { return std::chrono::steady_clock::now(); };
  std::function<void(std::chrono::nanoseconds)> sleep = [](auto time) { std::this_thread::sleep_for(time); };
};

}  // namespace slsd
