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
#include "tests/drivers/camera/v4l2_backends.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using test::DoubleFaults;
using test::DoubleOptions;
using ::testing::AnyOf;

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
