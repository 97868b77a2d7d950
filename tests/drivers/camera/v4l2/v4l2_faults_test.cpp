// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// What the camera makes of each fault of its device.
#include <dirent.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <thread>

#include <gmock/gmock.h>

#include "tests/doubles/v4l2/numbered_frame.hpp"
#include "tests/drivers/camera/v4l2/v4l2_backends.hpp"
#include "tests/drivers/no_descriptors.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using test::DoubleFaults;
using test::DoubleOptions;
using ::testing::AnyOf;
using ::testing::HasSubstr;

class V4l2Faults : public test::V4l2Test {
 protected:
  /// An open camera on a triggered double that gave one frame already.
  bool open_triggered(DoubleOptions options = test::triggered_double()) {
    if (!make(std::move(options))) return false;
    EXPECT_TRUE(camera_->open());
    EXPECT_TRUE(capture_one());
    return !HasFailure();
  }

  ErrorCode capture_until_it_fails() {
    while (true) {
      const auto frame = capture();
      if (!frame) return frame.error().code;
      EXPECT_TRUE(test::number_of(frame->image()));
    }
  }

  /// The number of one frame of the triggered double.
  std::optional<std::uint64_t> next_sequence() {
    const auto frame = capture_one();
    EXPECT_TRUE(frame) << to_string(frame.error());
    return frame ? std::optional(frame->sequence()) : std::nullopt;
  }

  ErrorCode code_of(const Result<Frame>& frame) {
    EXPECT_FALSE(frame);
    return frame ? ErrorCode{} : frame.error().code;
  }
};

TEST_F(V4l2Faults, AGapIsADroppedFrame) {
  if (!open_triggered()) return;
  double_->inject([](DoubleFaults& faults) { faults.drop = 1; });
  auto frame = begin_capture();
  double_->trigger();
  double_->trigger();
  EXPECT_EQ(code_of(frame.get()), ErrorCode::kFrameDropped);
  EXPECT_EQ(next_sequence(), 2U);
  EXPECT_EQ(camera_->counts().dropped, 1U);
  EXPECT_EQ(camera_->counts().delivered, 2U);
}

TEST_F(V4l2Faults, AFlaggedFrameIsTorn) {
  if (!open_triggered()) return;
  double_->inject([](DoubleFaults& faults) { faults.flag = 1; });
  EXPECT_EQ(code_of(capture_one()), ErrorCode::kFrameTorn);
  EXPECT_EQ(next_sequence(), 2U);
  EXPECT_EQ(camera_->counts().torn, 1U);
}

TEST_F(V4l2Faults, AShortFrameIsTorn) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG}) {
    DoubleOptions options = test::triggered_double();
    options.formats = {{fourcc, {{160, 120}}}};
    if (!open_triggered(options)) return;
    double_->inject([](DoubleFaults& faults) { faults.shorten = 1; });
    EXPECT_EQ(code_of(capture_one()), ErrorCode::kFrameTorn);
    EXPECT_TRUE(capture_one());
    camera_.reset();
  }
}

TEST_F(V4l2Faults, AStaleFrameIsNeverHandedOut) {
  if (!open_triggered()) return;
  double_->inject([](DoubleFaults& faults) { faults.age = 3; });
  auto frame = begin_capture(1s);
  for (int i = 0; i < 3; ++i) double_->trigger();
  EXPECT_THAT(code_of(frame.get()), AnyOf(ErrorCode::kFrameStale, ErrorCode::kFrameLate));
  double_->inject([](DoubleFaults& faults) { faults.age = 0; });
  EXPECT_TRUE(capture_one());
}

TEST_F(V4l2Faults, AStallIsALateFrame) {
  if (!open_triggered()) return;
  double_->stall(1h);
  auto frame = begin_capture(50ms);
  double_->trigger();
  EXPECT_EQ(code_of(frame.get()), ErrorCode::kFrameLate);
  frame = begin_capture();
  double_->stall(0s);
  EXPECT_TRUE(frame.get());
}

TEST_F(V4l2Faults, APassingFaultOfTheDriverCostsAFrame) {
  if (!open_triggered()) return;
  auto frame = begin_capture();
  double_->inject([](DoubleFaults& faults) { faults.fail_dequeue = 1; });
  EXPECT_EQ(code_of(frame.get()), ErrorCode::kFrameDropped);
  EXPECT_TRUE(capture_one());
}

TEST_F(V4l2Faults, ALastingFaultOfTheDriverIsADisconnection) {
  if (!open_triggered()) return;
  double_->inject([](DoubleFaults& faults) { faults.fail_dequeue = 1 << 20; });
  ErrorCode code = ErrorCode::kFrameDropped;
  for (int i = 0; i < 100 && code == ErrorCode::kFrameDropped; ++i) code = code_of(capture());
  EXPECT_EQ(code, ErrorCode::kDisconnected);
}

TEST_F(V4l2Faults, AnUnpluggedCameraIsGoneUntilItIsOpenedAnew) {
  DoubleOptions options = test::triggered_double();
  options.controls = test::uvc_controls();
  if (!make(options, {.exposure_us = 5000.0})) return;
  ASSERT_TRUE(camera_->open());
  auto frame = begin_capture();
  double_->unplug();
  EXPECT_EQ(code_of(frame.get()), ErrorCode::kDisconnected);
  EXPECT_EQ(code_of(capture()), ErrorCode::kDisconnected);
  EXPECT_EQ(camera_->open().error().code, ErrorCode::kNotFound);
  double_->replug();
  EXPECT_EQ(code_of(capture()), ErrorCode::kDisconnected);
  const auto opened = camera_->open();
  ASSERT_TRUE(opened) << to_string(opened.error());
  EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_ABSOLUTE), 50);
  EXPECT_EQ(next_sequence(), 0U);
}

TEST_F(V4l2Faults, AnUnpluggedCameraIsGoneToTheNextCapture) {
  if (!open_triggered()) return;
  double_->unplug();
  double_->replug();
  EXPECT_EQ(code_of(capture()), ErrorCode::kDisconnected);
}

/// Looks at the camera again and again, as its supervisor does, for the time or until it is found dead.
Result<> look_after(Camera& camera, std::chrono::nanoseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  Result<> there = camera.check();
  while (there && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(20ms);
    there = camera.check();
  }
  return there;
}

class V4l2DeadStream : public V4l2Faults {
 protected:
  bool open_on(DoubleOptions options, V4l2CameraOptions camera = {}) {
    if (!make(std::move(options), std::move(camera))) return false;
    EXPECT_TRUE(camera_->open());
    return !HasFailure();
  }
  void die() {
    double_->inject([](DoubleFaults& faults) { faults.dead = true; });
  }
  void expect_back() {
    EXPECT_EQ(code_of(capture()), ErrorCode::kDisconnected);
    EXPECT_TRUE(camera_->open());
    EXPECT_TRUE(capture());
  }
};

TEST_F(V4l2DeadStream, IsClosedByTheCaptureThatWaits) {
  if (!open_on(test::quick_double())) return;
  EXPECT_TRUE(capture());
  die();
  EXPECT_EQ(capture_until_it_fails(), ErrorCode::kDisconnected);
  expect_back();
}

TEST_F(V4l2DeadStream, IsClosedByCapturesOfShortDeadlines) {
  if (!open_on(test::quick_double())) return;
  EXPECT_TRUE(capture());
  die();
  const auto capture_shortly = [&] {
    const auto frame = camera_->capture(std::chrono::steady_clock::now() + 30ms);
    return frame ? ErrorCode::kFrameLate : frame.error().code;
  };
  ErrorCode code = ErrorCode::kFrameLate;
  while (code == ErrorCode::kFrameLate) code = capture_shortly();
  EXPECT_EQ(code, ErrorCode::kDisconnected);
  expect_back();
}

TEST_F(V4l2DeadStream, IsClosedWhileNobodyAsks) {
  if (!open_on(test::quick_double())) return;
  EXPECT_TRUE(look_after(*camera_, 100ms));
  die();
  const auto there = look_after(*camera_, 1h);
  ASSERT_FALSE(there);
  EXPECT_EQ(there.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(there.error().message, HasSubstr("missed_frames_max"));
  expect_back();
}

TEST_F(V4l2DeadStream, IsNotOneThatNobodyAsks) {
  if (!open_on(test::quick_double())) return;
  EXPECT_TRUE(capture());
  EXPECT_TRUE(look_after(*camera_, 1500ms));
  const std::uint64_t next = double_->next_number();
  const auto frame = capture();
  ASSERT_TRUE(frame);
  EXPECT_GE(*test::number_of(frame->image()), next);
}

TEST_F(V4l2DeadStream, IsNotOneWhoseFramesAreAllHeld) {
  if (!open_on(test::quick_double(), {.frames_held_max = 2})) return;
  std::vector<Frame> held;
  for (auto frame = capture(); frame; frame = capture()) held.push_back(std::move(*frame));
  EXPECT_TRUE(look_after(*camera_, 1500ms));
  held.clear();
  EXPECT_TRUE(capture());
}

TEST_F(V4l2DeadStream, IsNotOneThatWaitsForItsTrigger) {
  if (!open_triggered()) return;
  EXPECT_TRUE(look_after(*camera_, 1200ms));
  EXPECT_EQ(code_of(camera_->capture(std::chrono::steady_clock::now() + 50ms)), ErrorCode::kFrameLate);
  EXPECT_TRUE(capture_one());
}

TEST_F(V4l2DeadStream, IsNotOpenedAsReady) {
  if (!make(test::quick_double())) return;
  double_->stall(1h);
  const auto opened = camera_->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kTimeout);
  double_->stall(0s);
  EXPECT_TRUE(camera_->open());
}

TEST_F(V4l2DeadStream, IsNotWaitedForOnceCancelled) {
  if (!make(test::quick_double())) return;
  double_->stall(1h);
  const std::uint64_t polls = double_->polls();
  auto opened = std::async(std::launch::async, [&] { return camera_->open(); });
  while (double_->polls() == polls) std::this_thread::sleep_for(100us);
  camera_->cancel();
  const auto result = opened.get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
}

TEST_F(V4l2Faults, WithoutDescriptorsACameraSaysSoAndHealsWithThem) {
  if (!make(test::quick_double())) return;
  {
    const test::NoDescriptors none;
    const auto opened = camera_->open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kNoSpace);
    EXPECT_THAT(opened.error().message, HasSubstr("LimitNOFILE"));
    camera_->cancel();
  }
  ASSERT_TRUE(camera_->open());
  EXPECT_TRUE(capture());
  double_->stall(1h);
  auto frame = begin_capture(10s);
  const test::NoDescriptors none;
  camera_->cancel();
  EXPECT_THAT(code_of(frame.get()), AnyOf(ErrorCode::kCancelled, ErrorCode::kDisconnected));
}

std::ptrdiff_t open_descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

TEST_F(V4l2Faults, LeaveNothingBehindAfterManyLives) {
  if (!make(test::quick_double())) return;
  std::mt19937 random(7);
  std::ptrdiff_t descriptors = 0;
  for (int life = 0; life < 40; ++life) {
    ASSERT_TRUE(camera_->open());
    if (life == 1) descriptors = open_descriptors();
    if (life > 1) {
      EXPECT_EQ(open_descriptors(), descriptors);
    }
    std::jthread hand([&, wait = std::chrono::microseconds(random() % 10000)] {
      std::this_thread::sleep_for(wait);
      double_->unplug();
    });
    EXPECT_EQ(capture_until_it_fails(), ErrorCode::kDisconnected);
    hand.join();
    double_->replug();
  }
}

}  // namespace
}  // namespace slsd
