// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <barrier>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <random>
#include <thread>

#include <gmock/gmock.h>

#include "drivers/camera/aravis/device/device_clock.hpp"
#include "drivers/camera/aravis/gige/action_group.hpp"
#include "tests/drivers/camera/aravis/aravis_test.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::counter_of;
using test::far_away;
using ::testing::HasSubstr;

/// Two cameras that expose at one action command. Their keys are of this test only: others may run beside it.
class ActionGroupTest : public test::AravisTest {
 protected:
  [[nodiscard]] AravisCameraOptions options_for(const test::GigeCamera& device) const {
    AravisCameraOptions options = test::options_for(device);
    options.trigger = AravisTrigger::kAction;
    options.action = keys_;
    return options;
  }

  /// One frame of each, asked for by a thread each, as nearly at once as the machine allows.
  static std::pair<Result<Frame>, Result<Frame>> capture_both(Camera& left, Camera& right) {
    std::barrier both(2);
    auto frame = std::async(std::launch::async, [&] {
      both.arrive_and_wait();
      return left.capture(far_away());
    });
    both.arrive_and_wait();
    auto other = right.capture(far_away());
    return {frame.get(), std::move(other)};
  }

  ActionKeys keys_{std::random_device{}(), std::random_device{}(), 1};
  test::GigeCamera other_device_;
};

TEST_F(ActionGroupTest, ExposesAllCamerasAtOneCommand) {
  AravisCamera left(options_for(device_));
  AravisCamera right(options_for(other_device_));
  ASSERT_TRUE(opens(left));
  ASSERT_TRUE(opens(right));
  int at_one_command = 0;
  for (int i = 0; i < 20; ++i) {
    const int before = device_.actions().received;
    const MonotonicTime asked = steady_clock::now();
    const auto [frame, other] = capture_both(left, right);
    ASSERT_TRUE(frame && other);
    EXPECT_TRUE(counter_of(frame->image()));
    EXPECT_TRUE(counter_of(other->image()));
    EXPECT_GE(frame->exposure_start(), asked);
    EXPECT_GE(other->exposure_start(), asked);
    at_one_command += device_.actions().received == before + 1 ? 1 : 0;
  }
  // On a busy machine one may ask later than the other waits; each would else ask for itself every time.
  EXPECT_GT(at_one_command, 0);
  // A device may still have the last command in its queue.
  const auto end = steady_clock::now() + 10s;
  while (device_.actions().received != other_device_.actions().received && steady_clock::now() < end)
    std::this_thread::sleep_for(1ms);
  EXPECT_EQ(device_.actions().received, other_device_.actions().received);
}

TEST_F(ActionGroupTest, ExposesAtOneTimeByACommonClock) {
  AravisCameraOptions options = options_for(device_);
  AravisCameraOptions other_options = options_for(other_device_);
  options.ptp = other_options.ptp = true;
  options.action_lead_us = other_options.action_lead_us = 50000.0;
  AravisCamera left(options);
  AravisCamera right(other_options);
  ASSERT_TRUE(opens(left));
  ASSERT_TRUE(opens(right));
  const MonotonicTime asked = steady_clock::now();
  const auto [frame, other] = capture_both(left, right);
  ASSERT_TRUE(frame && other);
  // A double acts when the time has come, not before; how much later depends on the machine.
  EXPECT_GE(frame->exposure_start(), asked + 40ms);
  EXPECT_GE(other->exposure_start(), asked + 40ms);
}

// By a clock of its own a camera would expose at any time, or never.
TEST_F(ActionGroupTest, ExposesAtOnceUntilTheClockIsTheNetworks) {
  for (const auto& [status, scheduled] : {std::pair(8u, 0), std::pair(0u, 0), std::pair(9u, 1)}) {
    test::GigeCameraOptions following;
    following.ptp_status = status;
    test::GigeCamera device(following);
    AravisCameraOptions options = options_for(device);
    options.ptp = true;
    options.action_lead_us = 50000.0;
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    EXPECT_TRUE(next(camera));
    EXPECT_EQ(device.actions().received, 1) << status;
    EXPECT_EQ(device.actions().scheduled, scheduled) << status;
  }
}

// One that was taken before would be past when the command is sent.
TEST_F(ActionGroupTest, TakesTheTimeWhenTheOthersHaveBeenWaitedFor) {
  const auto group = std::make_shared<ActionGroup>(keys_);
  ActionGroup::Member asked(group, device_.address(), "");
  const ActionGroup::Member other(group, other_device_.address(), "");
  const MonotonicTime begin = steady_clock::now();
  MonotonicTime taken = begin;
  asked.trigger([&] {
    taken = steady_clock::now();
    return std::nullopt;
  });
  EXPECT_GE(taken - begin, 5ms);
}

TEST_F(ActionGroupTest, ExposesOneCameraThatIsAskedAlone) {
  AravisCamera left(options_for(device_));
  AravisCamera right(options_for(other_device_));
  ASSERT_TRUE(opens(left));
  ASSERT_TRUE(opens(right));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(next(left));
  EXPECT_TRUE(next(right));
}

TEST_F(ActionGroupTest, LeavesCamerasWithOtherKeysAlone) {
  AravisCameraOptions options = options_for(device_);
  AravisCamera left(options);
  options = options_for(other_device_);
  options.action.group_mask = 2;
  AravisCamera right(options);
  ASSERT_TRUE(opens(left));
  ASSERT_TRUE(opens(right));
  const std::uint32_t before = other_device_.frames_exposed();
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(next(left));
  EXPECT_EQ(device_.actions().received, 5);
  EXPECT_EQ(other_device_.actions().received, 0);
  EXPECT_EQ(other_device_.frames_exposed(), before);
}

TEST_F(ActionGroupTest, IsDisconnectedWhenNoFrameComes) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 1500;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.silent = true});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameDropped);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);
}

TEST(AravisCameraOptions, WantsACommonClockForACommonTime) {
  AravisCameraOptions options;
  options.id = "S77";
  options.action_lead_us = 1000.0;
  ASSERT_FALSE(options.validate());
  EXPECT_THAT(options.validate().error().message, HasSubstr("action_lead_us needs ptp"));
  options.ptp = true;
  EXPECT_TRUE(options.validate());
}

TEST(DeviceClock, TellsWhatTheDeviceShows) {
  DeviceClock clock;
  const MonotonicTime now = steady_clock::now();
  clock.observe({5s, now, now + 2us});
  EXPECT_EQ(clock.device_time(clock.host_time(7s)), 7s);
}

}  // namespace
}  // namespace slsd
