// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/duration.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

TEST(Duration, HasLastMeanAndLongest) {
  Duration duration;
  EXPECT_EQ(duration.mean(), 0ns);
  for (const auto time : {10ms, 40ms, 1ms}) duration.add(time);
  EXPECT_EQ(duration.last, 1ms);
  EXPECT_EQ(duration.longest, 40ms);
  EXPECT_EQ(duration.total, 51ms);
  EXPECT_EQ(duration.mean(), 17ms);
  EXPECT_EQ(duration.count, 3U);
}

TEST(Duration, CountsABoundInTheBucketBelowIt) {
  Duration duration;
  for (const std::chrono::microseconds time : {500us, 501us, 5000000us, 5000001us}) duration.add(time);
  EXPECT_THAT(duration.buckets, ElementsAre(1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1));
}

}  // namespace
}  // namespace slsd
