// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <atomic>
#include <future>
#include <thread>

#include <gtest/gtest.h>

#include "clients/dds/network/leaving.hpp"
#include "clients/dds/network/network.hpp"
#include "clients/dds/network/write_watch.hpp"
#include "clients/dds/ros.hpp"

namespace slsd::dds {
namespace {

TEST(Leaving, WaitsForUsesUnderWayAndLetsNoOtherBegin) {
  Leaving network;
  auto first = network.use();
  ASSERT_TRUE(first.owns_lock());
  std::atomic<bool> left{false};
  std::thread leaving([&] {
    const auto alone = network.leave();
    EXPECT_TRUE(alone.owns_lock());
    left = true;
  });
  while (network.use().owns_lock()) std::this_thread::yield();
  EXPECT_FALSE(left);
  first.unlock();
  leaving.join();
  EXPECT_FALSE(network.use().owns_lock());
  EXPECT_FALSE(network.leave().owns_lock());
}

TEST(WriteWatch, CountsTheLooksAtTheSameOldestWrite) {
  WriteWatch watch;
  EXPECT_EQ(watch.look(), 0);
  {
    const WriteWatch::Writing hangs(watch);
    EXPECT_EQ(watch.look(), 0);
    for (int looks = 1; looks < 5; ++looks) {
      const WriteWatch::Writing ends(watch);
      EXPECT_EQ(watch.look(), looks);
    }
  }
  EXPECT_EQ(watch.look(), 0);
  for (int i = 0; i < 5; ++i) {  // another one at each look
    const WriteWatch::Writing ends(watch);
    EXPECT_EQ(watch.look(), 0);
  }
}

TEST(Network, MakesNoEndpointsOnceItIsLeft) {
  NetworkOptions options;
  options.interface = "lo";
  auto network = Network::open(options);
  ASSERT_TRUE(network) << to_string(network.error());
  const auto before = network->writer(ros::String::kType, "rt/before", Quality::kService);
  ASSERT_TRUE(before);
  leave_networks();
  const auto writer = network->writer(ros::String::kType, "rt/after", Quality::kSensor);
  const auto reader = network->reader(ros::String::kType, "rt/after", Quality::kSensor);
  network->show_node("scanner");
  ASSERT_TRUE(writer && reader);
  EXPECT_TRUE(writer->write(ros::String{"nothing"}));
  EXPECT_TRUE(before->write(ros::String{"nothing"}));
  EXPECT_FALSE(writer->has_readers());
  EXPECT_FALSE(reader->take());
  EXPECT_FALSE(reader->has_news());
}

}  // namespace
}  // namespace slsd::dds
