// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/bounded_queue.hpp"

#include <thread>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

TEST(BoundedQueue, KeepsOrderAndCapacity) {
  BoundedQueue<int> queue(2);
  EXPECT_TRUE(queue.try_push(1));
  EXPECT_TRUE(queue.try_push(2));
  EXPECT_FALSE(queue.try_push(3));
  EXPECT_EQ(queue.try_pop(), 1);
  EXPECT_EQ(queue.try_pop(), 2);
  EXPECT_EQ(queue.try_pop(), std::nullopt);
}

TEST(BoundedQueue, PopEndsWithTheTimeAWakeOrAStop) {
  BoundedQueue<int> queue(1);
  std::stop_source stop;
  EXPECT_EQ(queue.pop_until(steady_clock::now(), stop.get_token()), std::nullopt);
  queue.wake();
  EXPECT_EQ(queue.pop_until(steady_clock::now() + 600s, stop.get_token()), std::nullopt);
  std::jthread stopper([&] { stop.request_stop(); });
  EXPECT_EQ(queue.pop_until(steady_clock::now() + 600s, stop.get_token()), std::nullopt);
}

TEST(BoundedQueue, PopWaitsForAnotherThread) {
  BoundedQueue<int> queue(1);
  std::jthread pusher([&] { EXPECT_TRUE(queue.try_push(7)); });
  EXPECT_EQ(queue.pop_until(steady_clock::now() + 600s, std::stop_token()), 7);
}

}  // namespace
}  // namespace slsd
