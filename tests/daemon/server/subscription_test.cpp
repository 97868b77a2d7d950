// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/subscription.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using Time = Subscription::Clock::time_point;

SharedPublication scan_number(std::uint64_t frame) {
  ScanResult scan;
  scan.cloud.frame = frame;
  return std::make_shared<Publication>(std::make_shared<const Result<ScanResult>>(std::move(scan)));
}

SharedPublication failed_scan() {
  return std::make_shared<Publication>(std::make_shared<const Result<ScanResult>>(fail(ErrorCode::kFrameTorn, "torn")));
}

nlohmann::json take(Subscription& subscription, Time now = Time()) {
  const auto event = subscription.take(now);
  return event ? nlohmann::json::parse(event->line) : nlohmann::json();
}

TEST(Subscription, GivesThoseThatCameTogetherInTheirOrder) {
  Subscription subscription(CloudFormat::kPly, std::nullopt);
  EXPECT_FALSE(subscription.take(Time()));
  for (const std::uint64_t frame : {1, 2, 3}) subscription.offer(scan_number(frame), Time());
  for (const std::uint64_t frame : {1, 2, 3}) {
    const auto event = take(subscription);
    EXPECT_EQ(event["method"], "cloud");
    EXPECT_EQ(event["params"]["frame"], frame);
    EXPECT_EQ(event["params"]["lost"], 0);
  }
  EXPECT_FALSE(subscription.take(Time()));
}

TEST(Subscription, LosesTheOldestOfTooManyAndCountsThem) {
  Subscription subscription(CloudFormat::kPly, std::nullopt);
  for (std::uint64_t frame = 1; frame <= Subscription::kWaitingMax + 2; ++frame)
    subscription.offer(scan_number(frame), Time());
  const auto event = take(subscription);
  EXPECT_EQ(event["params"]["frame"], 3);
  EXPECT_EQ(event["params"]["lost"], 2);
  EXPECT_EQ(take(subscription)["params"]["lost"], 0);
  subscription.note_lost(5);
  EXPECT_EQ(take(subscription)["params"]["lost"], 5);
}

TEST(Subscription, SaysWhatWaits) {
  Subscription subscription(CloudFormat::kPly, std::nullopt);
  EXPECT_EQ(subscription.waiting_bytes(), 0U);
  for (const std::uint64_t frame : {1, 2}) {
    ScanResult scan;
    scan.cloud.frame = frame;
    scan.cloud.points.resize(1000);
    subscription.offer(std::make_shared<Publication>(std::make_shared<const Result<ScanResult>>(std::move(scan))),
                       Time());
  }
  EXPECT_EQ(subscription.waiting_bytes(), 2000 * sizeof(CloudPoint));
  subscription.lose_oldest();
  EXPECT_EQ(subscription.waiting_bytes(), 1000 * sizeof(CloudPoint));
  const auto event = take(subscription);
  EXPECT_EQ(event["params"]["frame"], 2);
  EXPECT_EQ(event["params"]["lost"], 1);
  EXPECT_EQ(subscription.waiting_bytes(), 0U);
}

TEST(Subscription, GivesWhoReadsLateTheNewestOnly) {
  Subscription subscription(CloudFormat::kPly, std::nullopt);
  for (const std::uint64_t frame : {1, 2, 3}) subscription.offer(scan_number(frame), Time() + frame * 10ms);
  const auto event = take(subscription, Time() + 1h);
  EXPECT_EQ(event["params"]["frame"], 3);
  EXPECT_EQ(event["params"]["lost"], 2);
}

TEST(Subscription, GivesAnOldOneWhereNoneIsNewer) {
  Subscription subscription(CloudFormat::kPly, std::nullopt);
  subscription.offer(scan_number(1), Time());
  EXPECT_EQ(take(subscription, Time() + 1h)["params"]["frame"], 1);
}

TEST(Subscription, TellsOfFailures) {
  Subscription subscription(CloudFormat::kPly, std::nullopt);
  subscription.offer(failed_scan(), Time());
  const auto event = take(subscription);
  EXPECT_EQ(event["method"], "scan_failed");
  EXPECT_EQ(event["params"]["error"]["data"]["name"], "frame_torn");
}

TEST(Subscription, KeepsItsRate) {
  Subscription subscription(CloudFormat::kPly, 10.0);
  const Time begin = Time() + 1h;
  int taken = 0;
  for (int i = 0; i < 1000; ++i) {
    subscription.offer(scan_number(static_cast<std::uint64_t>(i)), begin + i * 10ms);
    if (subscription.take(begin + i * 10ms)) ++taken;
  }
  EXPECT_NEAR(taken, 100, 2);
}

TEST(Subscription, TakesEveryScanMadeAtItsOwnRate) {
  Subscription subscription(CloudFormat::kPly, 10.0);
  const Time begin = Time() + 1h;
  for (int i = 0; i < 100; ++i) {
    subscription.offer(scan_number(1), begin + i * 100ms + (i % 2 == 0 ? 3ms : -3ms));
    EXPECT_TRUE(subscription.take(begin + i * 100ms)) << i;
  }
}

TEST(Subscription, FollowsTheLineWithTheBytes) {
  Subscription subscription(CloudFormat::kPcd, std::nullopt);
  subscription.offer(scan_number(1), Time());
  const auto event = subscription.take(Time());
  ASSERT_TRUE(event && event->bytes);
  EXPECT_EQ(nlohmann::json::parse(event->line)["params"]["bytes"], event->bytes->size());
  EXPECT_EQ(event->bytes->substr(0, 6), "# .PCD");
}

}  // namespace
}  // namespace slsd
