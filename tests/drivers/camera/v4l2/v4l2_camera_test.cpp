// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_camera.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <sstream>
#include <thread>

#include <gmock/gmock.h>

#include "tests/doubles/v4l2/numbered_frame.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/drivers/camera/v4l2/v4l2_backends.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using test::DoubleOptions;

class V4l2CameraTest : public test::V4l2Test {};

// Whatever the driver stamps, and however long nobody asked: the buffers are full of old frames then.
TEST_F(V4l2CameraTest, NeverGivesAFrameThatWasInFlightBeforeTheTrigger) {
  for (const std::uint32_t stamps : {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
                                     V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF,
                                     V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN | V4L2_BUF_FLAG_TSTAMP_SRC_EOF}) {
    DoubleOptions options = test::quick_double();
    options.stamp_flags = stamps;
    if (!make(options, {.settle_frames = 0})) return;
    ASSERT_TRUE(camera_->open());
    std::mt19937 random(3);
    for (int i = 0; i < 40; ++i) {
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 6000));
      const std::uint64_t next = double_->next_number();
      const auto frame = capture();
      ASSERT_TRUE(frame) << to_string(frame.error());
      const auto number = test::number_of(frame->image());
      ASSERT_TRUE(number);
      EXPECT_GE(*number, next);
    }
    camera_.reset();
  }
}

// Frames that were in flight at the change have the exposure before, whatever their stamps say.
TEST_F(V4l2CameraTest, PassesOverFramesThatAnotherExposureMayHaveBegun) {
  for (const std::uint32_t source : {V4L2_BUF_FLAG_TSTAMP_SRC_SOE, V4L2_BUF_FLAG_TSTAMP_SRC_EOF}) {
    DoubleOptions options = test::quick_double();
    options.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | source;
    options.controls = test::uvc_controls();
    if (!make(options, {.exposure_us = 500, .settle_frames = 0})) return;
    const auto opened = camera_->open();
    ASSERT_TRUE(opened) << to_string(opened.error());
    for (int i = 0; i < 10; ++i) {
      const double exposure_us = i % 2 == 0 ? 2000 : 500;
      ASSERT_TRUE(camera_->set_exposure(exposure_us));
      EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_ABSOLUTE), exposure_us / 100);
      const std::uint64_t next = double_->next_number();
      ASSERT_TRUE(camera_->set_exposure(exposure_us)) << "changes nothing";
      const auto frame = capture();
      ASSERT_TRUE(frame) << to_string(frame.error());
      EXPECT_GE(*test::number_of(frame->image()), next);
    }
    EXPECT_EQ(camera_->set_exposure(1e9).error().code, ErrorCode::kInvalidArgument);
    EXPECT_TRUE(capture());
    camera_.reset();
    EXPECT_EQ(V4l2Camera({.device = "x"}).set_exposure(500).error().code, ErrorCode::kDisconnected);
  }
}

// The time of day in the place of CLOCK_MONOTONIC, and someone sets it.
TEST_F(V4l2CameraTest, NeverGivesAnOldFrameWhereTheDriverStampsTheTimeOfDay) {
  static constexpr auto kFiftyYears = std::chrono::hours(24 * 365 * 50);
  DoubleOptions options = test::quick_double();
  options.stamp_offset = kFiftyYears;
  if (!make(options, {.settle_frames = 0})) return;
  ASSERT_TRUE(camera_->open());
  std::mt19937 random(3);
  for (int i = 0; i < 40; ++i) {
    if (i == 20) double_->configure([](DoubleOptions& changed) { changed.stamp_offset = kFiftyYears - 1h; });
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 6000));
    const std::uint64_t next = double_->next_number();
    const auto frame = capture();
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_GE(*test::number_of(frame->image()), next);
  }
}

TEST_F(V4l2CameraTest, GivesTheFrameOfTheTrigger) {
  if (!make(test::triggered_double())) return;
  ASSERT_TRUE(camera_->open());
  double_->trigger();
  while (double_->next_number() == 0) std::this_thread::sleep_for(100us);
  const auto frame = capture_one();
  ASSERT_TRUE(frame);
  EXPECT_EQ(test::number_of(frame->image()), 1U);
}

TEST_F(V4l2CameraTest, DiscardsTheFramesThatSettleIt) {
  if (!make(test::quick_double(), {.settle_frames = 10})) return;
  ASSERT_TRUE(camera_->open());
  const auto frame = capture();
  ASSERT_TRUE(frame);
  EXPECT_GE(*test::number_of(frame->image()), 10U);
}

std::string mapping_of(const void* address) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    char dash = 0;
    std::istringstream(line) >> std::hex >> begin >> dash >> end;
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    if (at >= begin && at < end) return line;
  }
  return {};
}

TEST_F(V4l2CameraTest, LendsTheDriversOwnBuffers) {
  if (!make(test::quick_double())) return;
  ASSERT_TRUE(camera_->open());
  const auto frame = capture();
  ASSERT_TRUE(frame);
  EXPECT_THAT(mapping_of(std::get<ImageView<std::uint8_t>>(frame->image()).pixels), ::testing::HasSubstr("video0"));
}

TEST_F(V4l2CameraTest, AllocatesNothingPerFrame) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_SRGGB8}) {
    DoubleOptions options = test::quick_double();
    options.formats = {{fourcc, {{160, 120}}}};
    if (!make(options)) return;
    ASSERT_TRUE(camera_->open());
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(capture());
    const std::uint64_t before = test::allocations();
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(capture());
    EXPECT_EQ(test::allocations(), before);
    camera_.reset();
  }
}

TEST_F(V4l2CameraTest, GivesColoursInWhiteLightAlone) {
  for (const std::uint32_t fourcc :
       {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_YUV420, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_SRGGB8}) {
    DoubleOptions options = test::quick_double();
    options.formats = {{fourcc, {{160, 120}}}};
    if (!make(options)) return;
    ASSERT_TRUE(camera_->open());
    EXPECT_TRUE(capture()->colours()->empty());
    camera_->expect(Picture::kWhite);
    const auto frame = capture();
    ASSERT_TRUE(frame) << to_string(frame.error());
    const auto colours = frame->colours();
    ASSERT_TRUE(colours) << to_string(colours.error());
    EXPECT_EQ(colours->width(), fourcc == V4L2_PIX_FMT_GREY ? 0 : 160) << fourcc_name(fourcc);
    camera_.reset();
  }
}

TEST_F(V4l2CameraTest, OpensAnewWhileFramesAreHeldAndLeavesThemAlone) {
  if (!make(test::quick_double())) return;
  ASSERT_TRUE(camera_->open());
  const auto held = capture();
  const auto number = test::number_of(held->image());
  for (int i = 0; i < 3; ++i) {
    const auto opened = camera_->open();
    ASSERT_TRUE(opened) << to_string(opened.error());
    for (int k = 0; k < 15; ++k) ASSERT_TRUE(capture());
  }
  EXPECT_EQ(test::number_of(held->image()), number);
  double_.reset();
  EXPECT_EQ(test::number_of(held->image()), number);
}

TEST_F(V4l2CameraTest, WaitsForADeviceThatAnotherHas) {
  if (!make(test::quick_double())) return;
  V4l2Camera other({.device = double_->path()});
  ASSERT_TRUE(other.open());
  EXPECT_EQ(camera_->open().error().code, ErrorCode::kBusy);
}

TEST_F(V4l2CameraTest, WorksWithTheFewBuffersThatADriverGives) {
  DoubleOptions options = test::quick_double();
  options.buffers_max = 3;
  if (!make(options)) return;
  ASSERT_TRUE(camera_->open());
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(capture());
  const auto held = capture();
  EXPECT_EQ(capture().error().code, ErrorCode::kBusy);
}

// The double itself, as another program meets it.
class V4l2DoubleTest : public test::V4l2Test {
 protected:
  bool open_blocking() {
    DoubleOptions options = test::triggered_double();
    options.controls = test::uvc_controls();
    if (!make(options)) return false;
    file_ = open(double_->path().c_str(), O_RDWR | O_CLOEXEC);
    return file_ >= 0;
  }
  void TearDown() override {
    if (file_ >= 0) close(file_);
  }
  void start() {
    v4l2_requestbuffers request{};
    request.count = 4;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    ASSERT_EQ(ioctl(file_, VIDIOC_REQBUFS, &request), 0);
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    ASSERT_EQ(ioctl(file_, VIDIOC_QBUF, &buffer), 0);
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    ASSERT_EQ(ioctl(file_, VIDIOC_STREAMON, &type), 0);
  }
  int dequeue() {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    return ioctl(file_, VIDIOC_DQBUF, &buffer) == 0 ? 0 : errno;
  }

  int file_ = -1;
};

TEST_F(V4l2DoubleTest, AnswersABlockingDequeueWhenAFrameComes) {
  if (!open_blocking()) return;
  start();
  auto dequeued = std::async(std::launch::async, [this] { return dequeue(); });
  EXPECT_EQ(dequeued.wait_for(20ms), std::future_status::timeout);
  double_->trigger();
  EXPECT_EQ(dequeued.get(), 0);
}

TEST_F(V4l2DoubleTest, EndsWhatWaitsWhenUnplugged) {
  if (!open_blocking()) return;
  start();
  auto dequeued = std::async(std::launch::async, [this] { return dequeue(); });
  EXPECT_EQ(dequeued.wait_for(20ms), std::future_status::timeout);
  double_->unplug();
  EXPECT_EQ(dequeued.get(), ENODEV);
  pollfd polled{file_, POLLIN | POLLPRI, 0};
  EXPECT_EQ(poll(&polled, 1, 1000), 1);
  EXPECT_EQ(polled.revents, POLLPRI | POLLERR | POLLHUP);
}

TEST_F(V4l2DoubleTest, TakesArraysOfControls) {
  if (!open_blocking()) return;
  std::array<v4l2_ext_control, 2> array{};
  array[0].id = V4L2_CID_EXPOSURE_AUTO;
  array[0].value = V4L2_EXPOSURE_MANUAL;
  array[1].id = V4L2_CID_EXPOSURE_ABSOLUTE;
  array[1].value = 77;
  v4l2_ext_controls controls{};
  controls.count = array.size();
  controls.controls = array.data();
  ASSERT_EQ(ioctl(file_, VIDIOC_S_EXT_CTRLS, &controls), 0) << errno;
  EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_ABSOLUTE), 77);
  array[1].value = 0;
  ASSERT_EQ(ioctl(file_, VIDIOC_G_EXT_CTRLS, &controls), 0);
  EXPECT_EQ(array[1].value, 77);
}

}  // namespace
}  // namespace slsd
