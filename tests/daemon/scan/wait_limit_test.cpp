// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/wait_limit.hpp"

#include <gmock/gmock.h>

#include "drivers/system/heartbeat.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

TEST(Backoff, DoublesUpToTheLongest) {
  Backoff backoff({.timeout_ms = 1, .exposure_skew_ms = 1, .reopen_first_ms = 10, .reopen_longest_ms = 50});
  EXPECT_EQ(backoff.next(), 10ms);
  EXPECT_EQ(backoff.next(), 20ms);
  EXPECT_EQ(backoff.next(), 40ms);
  EXPECT_EQ(backoff.next(), 50ms);
  EXPECT_EQ(backoff.next(), 50ms);
  backoff.reset();
  EXPECT_EQ(backoff.next(), 10ms);
}

TEST(Heartbeat, IsKeptUntilThePromisedTime) {
  Heartbeat heartbeat;
  EXPECT_TRUE(heartbeat.kept());
  heartbeat.promise(60s);
  EXPECT_TRUE(heartbeat.kept());
  EXPECT_FALSE(heartbeat.kept(steady_clock::now() + 61s));
  heartbeat.promise(-1s);
  EXPECT_FALSE(heartbeat.kept());
}

}  // namespace
}  // namespace slsd
