// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/faulty_camera.hpp"

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/camera/file_camera.hpp"
#include "tests/drivers/camera/recording.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::far_away;
using test::number_of;

class FaultyCameraTest : public ::testing::Test {
 protected:
  FaultyCameraTest() { test::record(folder_, 10); }

  std::unique_ptr<FaultyCamera> opened(const std::vector<std::string>& faults) {
    auto files = std::make_unique<FileCamera>(FileCameraOptions{.name = "left", .path = folder_.path()});
    auto camera = std::make_unique<FaultyCamera>(std::move(files), parse_faults(faults).value());
    EXPECT_TRUE(camera->open());
    return camera;
  }

  /// Captures, and expects a frame with this sequence number.
  static void expect_frame(Camera& camera, std::uint64_t sequence) {
    const auto frame = camera.capture(far_away());
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_EQ(frame->sequence(), sequence);
  }

  static void expect_error(Camera& camera, ErrorCode code, MonotonicTime deadline = far_away()) {
    const auto frame = camera.capture(deadline);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, code);
    EXPECT_EQ(frame.error().where, "left");
  }

  test::TemporaryFolder folder_;
};

TEST_F(FaultyCameraTest, DropsAFrameAndLeavesAGapInTheSequence) {
  const auto camera = opened({"drop@2"});
  expect_frame(*camera, 0);
  expect_error(*camera, ErrorCode::kFrameDropped);
  expect_frame(*camera, 2);
}

TEST_F(FaultyCameraTest, TearsAFrame) {
  const auto camera = opened({"tear@1"});
  expect_error(*camera, ErrorCode::kFrameTorn);
  expect_frame(*camera, 1);
}

TEST_F(FaultyCameraTest, DeliversALateFrameThatIsStillInTime) {
  const auto camera = opened({"late@1:5ms"});
  const MonotonicTime before = steady_clock::now();
  const auto frame = camera->capture(far_away());
  ASSERT_TRUE(frame);
  EXPECT_GE(frame->received() - frame->exposure_start(), 5ms);
  EXPECT_GE(steady_clock::now(), frame->received());
  EXPECT_GE(frame->exposure_start(), before);
}

TEST_F(FaultyCameraTest, ReportsAFrameThatIsPastItsDeadlineAtTheDeadline) {
  const auto camera = opened({"late@1:60s", "late@2"});
  for (int i = 0; i < 2; ++i) {
    const MonotonicTime deadline = steady_clock::now() + 5ms;
    expect_error(*camera, ErrorCode::kFrameLate, deadline);
    EXPECT_GE(steady_clock::now(), deadline);
  }
  expect_frame(*camera, 2);
}

TEST_F(FaultyCameraTest, DeliversAStaleFrameWithItsOldStamp) {
  const auto camera = opened({"stale@1:40ms", "stale@2"});
  for (const auto age : {40ms, 100ms}) {
    const MonotonicTime trigger = steady_clock::now();
    const auto frame = camera->capture(far_away());
    ASSERT_TRUE(frame);
    EXPECT_LT(frame->exposure_start(), trigger - age + 20s);
    EXPECT_GE(frame->exposure_start(), trigger - age);
    EXPECT_LE(frame->exposure_start(), steady_clock::now() - age);
    EXPECT_GE(frame->received(), trigger);
  }
}

TEST_F(FaultyCameraTest, StaysGoneUntilItIsOpenedAgain) {
  const auto camera = opened({"disconnect@2"});
  expect_frame(*camera, 0);
  expect_error(*camera, ErrorCode::kDisconnected);
  expect_error(*camera, ErrorCode::kDisconnected);
  ASSERT_TRUE(camera->open());
  expect_frame(*camera, 0);
}

TEST_F(FaultyCameraTest, CannotBeOpenedWhileItIsUnplugged) {
  const auto camera = opened({"disconnect@1:60s", "disconnect@2"});
  expect_error(*camera, ErrorCode::kDisconnected);
  EXPECT_EQ(camera->open().error().code, ErrorCode::kDisconnected);
  expect_error(*camera, ErrorCode::kDisconnected);
}

TEST_F(FaultyCameraTest, ComesBackAfterTheTimeThatItIsUnplugged) {
  const auto camera = opened({"disconnect@1:20ms"});
  const MonotonicTime before = steady_clock::now();
  expect_error(*camera, ErrorCode::kDisconnected);
  while (!camera->open()) std::this_thread::sleep_for(1ms);
  EXPECT_GE(steady_clock::now() - before, 20ms);
  expect_frame(*camera, 0);
}

TEST_F(FaultyCameraTest, StallsForSeveralCaptures) {
  const auto camera = opened({"stall@2:40ms"});
  expect_frame(*camera, 0);
  const MonotonicTime before = steady_clock::now();
  expect_error(*camera, ErrorCode::kFrameLate, before + 1ms);
  expect_frame(*camera, 1);
  EXPECT_GE(steady_clock::now() - before, 40ms);
}

TEST_F(FaultyCameraTest, StallsWithoutATimeUntilItIsOpened) {
  const auto camera = opened({"stall@1"});
  for (int i = 0; i < 3; ++i) expect_error(*camera, ErrorCode::kFrameLate, steady_clock::now() + 1ms);
  ASSERT_TRUE(camera->open());
  expect_frame(*camera, 0);
}

TEST_F(FaultyCameraTest, EndsAStallAndADelayWhenCancelled) {
  const auto camera = opened({"stall@1", "late@2"});
  for (int i = 0; i < 2; ++i) {
    std::jthread canceller([&] {
      std::this_thread::sleep_for(2ms);
      camera->cancel();
    });
    expect_error(*camera, ErrorCode::kCancelled);
    canceller.join();
    ASSERT_TRUE(i == 1 || camera->open());
  }
}

TEST_F(FaultyCameraTest, IsDoneWithACancelThatItAnswered) {
  const auto camera = opened({"late@1"});
  std::jthread canceller([&] {
    std::this_thread::sleep_for(2ms);
    camera->cancel();
  });
  expect_error(*camera, ErrorCode::kCancelled);
  canceller.join();
  EXPECT_TRUE(camera->capture(far_away()));
  EXPECT_TRUE(camera->capture(far_away()));
}

TEST_F(FaultyCameraTest, UsesTheFirstOfSeveralFaultsAtACapture) {
  const auto camera = opened({"tear@1", "drop@1"});
  expect_error(*camera, ErrorCode::kFrameTorn);
}

}  // namespace
}  // namespace slsd
