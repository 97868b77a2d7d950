// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/decode_lanes.hpp"

#include <atomic>
#include <future>
#include <new>
#include <optional>
#include <random>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

/// A job of a number that notes when it was delivered, and whether it had been computed.
class NumberJob final : public FrameJob {
 public:
  struct Delivered {
    int number;
    bool computed;
    friend bool operator==(const Delivered&, const Delivered&) = default;
  };
  using Log = std::vector<Delivered>;

  NumberJob(int number, Log& log, std::function<void()> work = {})
      : delivered_{number, false}, log_(log), work_(std::move(work)) {}
  void compute(std::size_t lane) override {
    lane_ = lane;
    if (work_) work_();
    delivered_.computed = true;
  }
  void fail_compute(std::size_t lane, Error error) override {
    EXPECT_EQ(lane, lane_);
    failed_ = std::move(error);
  }
  void deliver() override { log_.push_back(delivered_); }
  [[nodiscard]] const std::optional<Error>& failed() const { return failed_; }
  [[nodiscard]] std::size_t lane() const { return lane_; }

 private:
  Delivered delivered_;
  Log& log_;
  std::function<void()> work_;
  std::optional<Error> failed_;
  std::atomic<std::size_t> lane_{DecodeLanes::kMaxLanes};
};

TEST(DecodeLanes, FailOnlyTheJobForWhichMemoryRunsOut) {
  NumberJob::Log delivered;
  DecodeLanes lanes(1);
  const auto large = std::make_shared<NumberJob>(1, delivered, [] { throw std::bad_alloc(); });
  lanes.push(large);
  lanes.push(std::make_shared<NumberJob>(2, delivered));
  while (lanes.done() < 2) std::this_thread::yield();
  EXPECT_EQ(delivered, (NumberJob::Log{{1, false}, {2, true}}));
  ASSERT_TRUE(large->failed());
  EXPECT_EQ(large->failed()->code, ErrorCode::kNoSpace);
}

/// Work that ends when the gate is opened, and tells that it has begun.
struct Gate {
  std::promise<void> opened;
  std::shared_future<void> open = opened.get_future().share();
  std::atomic<int> inside{0};

  std::function<void()> work() {
    return [this] {
      ++inside;
      open.wait();
    };
  }
  void wait_inside(int count) const {
    while (inside < count) std::this_thread::yield();
  }
};

void wait_for(DecodeLanes& lanes, std::uint64_t done) {
  while (lanes.done() < done) std::this_thread::sleep_for(1ms);
}

TEST(DecodeLanes, DeliverInTheOrderOfArrivalWhicheverLaneIsQuicker) {
  constexpr int kJobs = 200;
  NumberJob::Log log;
  DecodeLanes lanes(2);
  std::minstd_rand random(7);
  for (int i = 0; i < kJobs; ++i) {
    const auto time = std::chrono::microseconds(random() % 300);
    lanes.push(std::make_unique<NumberJob>(i, log, [time] { std::this_thread::sleep_for(time); }));
  }
  wait_for(lanes, kJobs);
  ASSERT_EQ(log.size(), kJobs);
  for (int i = 0; i < kJobs; ++i) EXPECT_EQ(log[static_cast<std::size_t>(i)], (NumberJob::Delivered{i, true}));
  EXPECT_EQ(lanes.skipped(), 0U);
}

TEST(DecodeLanes, OfJobsThatDoNotOverlapShareTheFirst) {
  NumberJob::Log log;
  DecodeLanes lanes(2);
  for (int i = 0; i < 50; ++i) {
    const auto job = std::make_shared<NumberJob>(i, log);
    lanes.push(job);
    wait_for(lanes, static_cast<std::uint64_t>(i) + 1);
    EXPECT_EQ(job->lane(), 0U);
  }
}

TEST(DecodeLanes, OfJobsThatOverlapDiffer) {
  NumberJob::Log log;
  Gate gate;
  DecodeLanes lanes(2);
  const auto first = std::make_shared<NumberJob>(0, log, gate.work()),
             second = std::make_shared<NumberJob>(1, log, gate.work());
  lanes.push(first), lanes.push(second);
  gate.wait_inside(2);
  EXPECT_EQ(first->lane() + second->lane(), 1U);
  gate.opened.set_value();
  wait_for(lanes, 2);
}

/// One lane, whose job 0 is under way until the gate opens.
class BusyLane : public ::testing::Test {
 protected:
  BusyLane() {
    lanes_.offer(std::make_unique<NumberJob>(0, log_, gate_.work()));
    gate_.wait_inside(1);
  }
  [[nodiscard]] std::shared_ptr<FrameJob> job(int number) { return std::make_unique<NumberJob>(number, log_); }
  void finish(std::uint64_t done) {
    gate_.opened.set_value();
    wait_for(lanes_, done);
  }
  /// Tells that job 0 and then these were delivered, all computed.
  void expect_computed(const std::vector<int>& others) const {
    NumberJob::Log expected{{0, true}};
    for (const int number : others) expected.push_back({number, true});
    EXPECT_EQ(log_, expected);
  }

  NumberJob::Log log_;
  Gate gate_;
  DecodeLanes lanes_{1};
  const std::chrono::steady_clock::time_point now_ = steady_clock::now();
};

TEST_F(BusyLane, NewestOfferedWinsAndThoseSkippedAreCounted) {
  for (int i = 1; i <= 5; ++i) lanes_.offer(job(i), now_);
  EXPECT_EQ(lanes_.skipped(), 2U);
  finish(6);
  expect_computed({3, 4, 5});
}

TEST_F(BusyLane, WhatHasWaitedForTooLongMakesRoom) {
  for (int i = 1; i <= 3; ++i) lanes_.offer(job(i), now_ + i * (DecodeLanes::kTurn + 1ms));
  EXPECT_EQ(lanes_.skipped(), 2U);
  finish(4);
  expect_computed({3});
}

TEST_F(BusyLane, WhatWasPushedIsNeverSkipped) {
  lanes_.push(job(1));
  for (int i = 2; i <= 4; ++i) lanes_.offer(job(i), now_ + i * DecodeLanes::kTurn * 2);
  EXPECT_EQ(lanes_.skipped(), 2U);
  finish(5);
  expect_computed({1, 4});
}

TEST_F(BusyLane, StopDeliversWhatWasNotComputed) {
  lanes_.push(job(1));
  lanes_.request_stop();
  EXPECT_FALSE(lanes_.stopped());
  gate_.opened.set_value();
  while (!lanes_.stopped()) std::this_thread::sleep_for(1ms);
  lanes_.push(job(2));
  EXPECT_THAT(log_, ::testing::ElementsAre(NumberJob::Delivered{0, true}, NumberJob::Delivered{1, false},
                                           NumberJob::Delivered{2, false}));
}

TEST(DecodeLanes, WaitDoneEndsWithAJobTheTimeOrNothingUnderWay) {
  NumberJob::Log log;
  Gate gate;
  DecodeLanes lanes(2);
  EXPECT_FALSE(lanes.wait_done(0, steady_clock::now() + 600s));
  lanes.push(std::make_unique<NumberJob>(0, log, gate.work()));
  EXPECT_FALSE(lanes.wait_done(0, steady_clock::now()));
  gate.opened.set_value();
  EXPECT_TRUE(lanes.wait_done(0, steady_clock::now() + 600s));
}

}  // namespace
}  // namespace slsd
