// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/cancel_latch.hpp"

#include <chrono>
#include <thread>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

TEST(CancelLatch, SleepsUntilTheTime) {
  CancelLatch latch;
  const MonotonicTime time = steady_clock::now() + 5ms;
  EXPECT_FALSE(latch.wait_until(time));
  EXPECT_GE(steady_clock::now(), time);
}

TEST(CancelLatch, DoesNotSleepUntilAPastTime) {
  CancelLatch latch;
  EXPECT_FALSE(latch.wait_until(MonotonicTime::min()));
  EXPECT_FALSE(latch.wait_until(steady_clock::now() - 1s));
}

TEST(CancelLatch, EndsASleepWithoutEndFromAnotherThread) {
  CancelLatch latch;
  std::jthread canceller([&] {
    std::this_thread::sleep_for(2ms);
    latch.cancel();
  });
  EXPECT_TRUE(latch.wait_until(MonotonicTime::max()));
}

TEST(CancelLatch, RemembersACancelForOneSleep) {
  CancelLatch latch;
  latch.cancel();
  latch.cancel();
  EXPECT_TRUE(latch.wait_until(MonotonicTime::max()));
  EXPECT_FALSE(latch.wait_until(steady_clock::now()));
}

TEST(CancelLatch, ForgetsACancelOnReset) {
  CancelLatch latch;
  latch.cancel();
  latch.reset();
  EXPECT_FALSE(latch.wait_until(steady_clock::now()));
}

}  // namespace
}  // namespace slsd
