// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/wake_event.hpp"

#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>

#include <gmock/gmock.h>

#include "drivers/system/file_descriptor.hpp"
#include "tests/drivers/no_descriptors.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using Woken = WakeEvent::Woken;

struct WakeEventTest : testing::Test {
  void SetUp() override {
    ASSERT_TRUE(event.open());
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    out = FileDescriptor(ends[0]);
    in = FileDescriptor(ends[1]);
  }
  WakeEvent event;
  FileDescriptor out;  ///< of a pipe
  FileDescriptor in;
};

TEST_F(WakeEventTest, SleepsUntilTheTime) {
  const WakeEvent::Time time = steady_clock::now() + 5ms;
  EXPECT_FALSE(event.sleep_until(time));
  EXPECT_GE(steady_clock::now(), time);
}

TEST_F(WakeEventTest, DoesNotSleepUntilAPastTime) {
  EXPECT_FALSE(event.sleep_until(WakeEvent::Time::min()));
  EXPECT_FALSE(event.sleep_until(steady_clock::now() - 1s));
}

TEST_F(WakeEventTest, EndsASleepWithoutEndFromAnotherThread) {
  std::jthread waker([&] {
    std::this_thread::sleep_for(2ms);
    event.wake();
  });
  EXPECT_TRUE(event.sleep_until(WakeEvent::Time::max()));
}

TEST_F(WakeEventTest, RemembersAWakeForOneSleep) {
  event.wake();
  event.wake();
  EXPECT_TRUE(event.sleep_until(WakeEvent::Time::max()));
  EXPECT_FALSE(event.sleep_until(steady_clock::now()));
}

TEST_F(WakeEventTest, ForgetsAWakeOnReset) {
  event.wake();
  event.reset();
  EXPECT_FALSE(event.sleep_until(steady_clock::now()));
}

TEST_F(WakeEventTest, TellsWhatEndedAWait) {
  EXPECT_EQ(event.wait(out.number(), steady_clock::now()), Woken::kLate);
  ASSERT_EQ(::write(in.number(), "x", 1), 1);
  EXPECT_EQ(event.wait(out.number(), WakeEvent::Time::max()), Woken::kReady);
  event.wake();
  EXPECT_EQ(event.wait(out.number(), WakeEvent::Time::max()), Woken::kWoken);
  in = {};
  EXPECT_EQ(event.wait(out.number(), WakeEvent::Time::max()), Woken::kGone);
}

TEST(WakeEvent, KeepsAWakeThatComesBeforeOpening) {
  WakeEvent event;
  event.wake();
  ASSERT_TRUE(event.open());
  EXPECT_TRUE(event.sleep_until(WakeEvent::Time::max()));
}

TEST(WakeEvent, SaysThatNoDescriptorIsLeftAndHealsWithOne) {
  WakeEvent event;
  {
    const test::NoDescriptors none;
    const auto opened = event.open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kNoSpace);
    EXPECT_THAT(opened.error().message, testing::HasSubstr("LimitNOFILE"));
  }
  ASSERT_TRUE(event.open());
  const test::NoDescriptors none;
  event.wake();
  EXPECT_TRUE(event.sleep_until(WakeEvent::Time::max()));
}

}  // namespace
}  // namespace slsd
