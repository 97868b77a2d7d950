// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <thread>
#include <variant>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/faulty_camera.hpp"
#include "drivers/camera/file_camera.hpp"
#include "tests/drivers/camera/aravis/gige_backend.hpp"
#include "tests/drivers/camera/recording.hpp"
#include "tests/drivers/camera/v4l2/v4l2_backends.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::far_away;
using test::samples_of;

/// A backend, and how to make one on recorded frames.
struct Backend {
  const char* name;
  std::function<std::unique_ptr<Camera>(const test::TemporaryFolder&)> make;
};

void PrintTo(const Backend& backend, std::ostream* out) {
  *out << backend.name;
}

std::unique_ptr<FileCamera> file_camera(const test::TemporaryFolder& folder, FileCameraOptions options = {}) {
  test::record(folder, 5);
  if (options.path.empty()) options.path = folder.path();
  return std::make_unique<FileCamera>(options);
}

std::unique_ptr<Camera> single_image(const test::TemporaryFolder& folder) {
  return file_camera(folder, {.path = folder.path() / "frame-2.pgm"});
}

std::unique_ptr<Camera> sixteen_bits(const test::TemporaryFolder& folder) {
  folder.write("deep/a.tif", test::tiff_bytes(samples_of(test::ramp16(12, 8)), true));
  folder.write("deep/b.png", test::png_bytes(samples_of(test::ramp16(12, 8, 5000))));
  return file_camera(folder, {.path = folder.path() / "deep"});
}

std::unique_ptr<Camera> on_gige(AravisCameraOptions options = {}, test::GigeCameraOptions device = {}) {
  options.packet_bytes = 1400;
  options.packet_socket = false;
  options.frame_timeout_ms = 10000;
  return std::make_unique<test::CameraOnDouble>(std::move(device), std::move(options));
}

class CameraContract : public ::testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    camera_ = GetParam().make(folder_);
    if (!camera_) GTEST_SKIP() << "no such camera here; docs/hardware.md says how to name one";
  }

  Result<Frame> capture() { return camera_->capture(far_away()); }

  test::TemporaryFolder folder_;
  std::unique_ptr<Camera> camera_;
};

std::pair<int, int> size_of(const Frame& frame) {
  return std::visit([](const auto& image) { return std::pair(image.width, image.height); }, frame.image());
}

std::vector<int> pixels_of(const Frame& frame) {
  std::vector<int> pixels;
  std::visit(
      [&](const auto& image) {
        for (int y = 0; y < image.height; ++y) pixels.insert(pixels.end(), image.row(y), image.row(y) + image.width);
      },
      frame.image());
  return pixels;
}

TEST_P(CameraContract, SaysWhatItIs) {
  const CameraDescription before = camera_->description();
  EXPECT_FALSE(before.name.empty() || before.driver.empty() || before.device.empty());
  EXPECT_EQ(before.width_px, 0);
  ASSERT_TRUE(camera_->open());
  EXPECT_GT(camera_->description().width_px, 0);
  EXPECT_GT(camera_->description().height_px, 0);
}

TEST_P(CameraContract, IsDisconnectedBeforeItIsOpened) {
  const auto frame = capture();
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kDisconnected);
}

TEST_P(CameraContract, IsThereOnceItIsOpen) {
  const auto before = camera_->check();
  ASSERT_FALSE(before);
  EXPECT_EQ(before.error().code, ErrorCode::kDisconnected);
  ASSERT_TRUE(camera_->open());
  EXPECT_TRUE(camera_->check());
  ASSERT_TRUE(capture());
  EXPECT_TRUE(camera_->check());
}

TEST_P(CameraContract, GivesTheFrameAfterTheOneGivenLast) {
  ASSERT_TRUE(camera_->open());
  MonotonicTime last = steady_clock::now();
  for (std::uint64_t i = 0; i < 5; ++i) {
    const auto frame = camera_->capture_next(far_away());
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_GE(frame->sequence(), i);
    EXPECT_GT(frame->exposure_start(), last);
    last = frame->exposure_start();
  }
  const MonotonicTime trigger = steady_clock::now();
  const auto fresh = capture();
  ASSERT_TRUE(fresh);
  EXPECT_GE(fresh->exposure_start(), trigger);
}

// What waits by then is of a scene that is over, and what was passed over nobody missed.
TEST_P(CameraContract, GivesNoOldFrameForTheNextAfterAPause) {
  ASSERT_TRUE(camera_->open());
  if (camera_->description().rate_hz == 0.0) GTEST_SKIP() << "does not run freely";
  const auto before = camera_->capture_next(far_away());
  ASSERT_TRUE(before) << to_string(before.error());
  const auto periods = [this](double count) {
    return std::chrono::nanoseconds(std::llround(1e9 * count / camera_->description().rate_hz));
  };
  std::this_thread::sleep_for(700ms + periods(10));
  const MonotonicTime asked = steady_clock::now();
  const auto frame = camera_->capture_next(far_away());
  ASSERT_TRUE(frame) << to_string(frame.error());
  EXPECT_GE(frame->exposure_start(), asked - 300ms - periods(6));
  EXPECT_EQ(frame->sequence(), before->sequence() + 1);
}

TEST_P(CameraContract, DeliversFramesOfTheSizeThatItSays) {
  ASSERT_TRUE(camera_->open());
  for (int i = 0; i < 7; ++i) {
    const auto frame = capture();
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_EQ(size_of(*frame), std::pair(camera_->description().width_px, camera_->description().height_px));
  }
}

TEST_P(CameraContract, ExposesAfterTheTriggerAndReceivesAfterTheExposure) {
  ASSERT_TRUE(camera_->open());
  for (int i = 0; i < 3; ++i) {
    const MonotonicTime trigger = steady_clock::now();
    const auto frame = capture();
    ASSERT_TRUE(frame);
    EXPECT_LE(trigger, frame->exposure_start());
    EXPECT_LE(frame->exposure_start(), frame->received());
    EXPECT_LE(frame->received(), steady_clock::now());
  }
}

TEST_P(CameraContract, NumbersFramesWithoutGapsAndAnewAfterOpen) {
  for (int opened = 0; opened < 2; ++opened) {
    ASSERT_TRUE(camera_->open());
    for (std::uint64_t i = 0; i < 7; ++i) {
      const auto frame = capture();
      ASSERT_TRUE(frame) << to_string(frame.error());
      EXPECT_EQ(frame->sequence(), i);
    }
  }
}

TEST_P(CameraContract, LeavesAHeldFrameAlone) {
  ASSERT_TRUE(camera_->open());
  const auto held = capture();
  const std::vector<int> pixels = pixels_of(*held);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(capture());
  EXPECT_EQ(pixels_of(*held), pixels);
}

TEST_P(CameraContract, IsBusyWhileAllItsFramesAreHeldAndGoesOnAfterwards) {
  ASSERT_TRUE(camera_->open());
  std::vector<Frame> held;
  while (held.size() < 100) {
    auto frame = capture();
    if (!frame) {
      EXPECT_EQ(frame.error().code, ErrorCode::kBusy);
      break;
    }
    held.push_back(std::move(*frame));
  }
  EXPECT_GE(held.size(), 2u);
  EXPECT_LT(held.size(), 100u);
  held.clear();
  EXPECT_TRUE(capture());
}

TEST_P(CameraContract, LeavesItsFramesValidAfterItsEnd) {
  ASSERT_TRUE(camera_->open());
  std::optional<Frame> frame(std::move(*capture()));
  const std::vector<int> pixels = pixels_of(*frame);
  camera_.reset();
  EXPECT_EQ(pixels_of(*frame), pixels);
  std::jthread([moved = std::move(*frame)] {}).join();
}

TEST_P(CameraContract, IsLateAfterTheDeadlineAndGoesOn) {
  ASSERT_TRUE(camera_->open());
  const auto frame = camera_->capture(steady_clock::now() - 1s);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kFrameLate);
  EXPECT_TRUE(capture());
}

TEST_P(CameraContract, EndsTheNextCaptureWhenCancelledBefore) {
  ASSERT_TRUE(camera_->open());
  camera_->cancel();
  const auto frame = capture();
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(capture());
}

TEST_P(CameraContract, ForgetsACancelWhenItIsOpened) {
  camera_->cancel();
  ASSERT_TRUE(camera_->open());
  EXPECT_TRUE(capture());
}

TEST_P(CameraContract, MayBeCancelledAtAnyTime) {
  ASSERT_TRUE(camera_->open());
  std::atomic<bool> done{false};
  std::jthread canceller([&] {
    while (!done) {
      camera_->cancel();
      std::this_thread::sleep_for(100us);
    }
  });
  for (int i = 0; i < 200; ++i) {
    const auto frame = capture();
    EXPECT_TRUE(frame || frame.error().code == ErrorCode::kCancelled);
  }
  done = true;
}

Backend v4l2_double(const char* name, std::uint32_t fourcc) {
  return {name, [fourcc](const auto&) { return test::v4l2_camera_on_double(fourcc); }};
}

INSTANTIATE_TEST_SUITE_P(V4l2, CameraContract,
                         ::testing::Values(v4l2_double("V4l2Grey", V4L2_PIX_FMT_GREY),
                                           v4l2_double("V4l2SixteenBits", V4L2_PIX_FMT_Y16),
                                           v4l2_double("V4l2Bayer", V4L2_PIX_FMT_SRGGB8),
                                           v4l2_double("V4l2Yuyv", V4L2_PIX_FMT_YUYV),
                                           v4l2_double("V4l2Mjpg", V4L2_PIX_FMT_MJPEG),
                                           Backend{"V4l2Real", [](const auto&) { return test::real_v4l2_camera(); }}),
                         [](const auto& instance) { return instance.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Backends, CameraContract,
    ::testing::Values(
        Backend{"FileFolder", [](const auto& folder) { return file_camera(folder); }},
        Backend{"FileSingleImage", single_image}, Backend{"FileSixteenBits", sixteen_bits},
        Backend{"FilePaced", [](const auto& folder) { return file_camera(folder, {.rate_hz = 1000.0}); }},
        Backend{"FileUncached", [](const auto& folder) { return file_camera(folder, {.cache_bytes = 0}); }},
        Backend{"FileBayer", [](const auto& folder) { return file_camera(folder, {.bayer = BayerPattern::kBggr}); }},
        Backend{"BehindNoFaults",
                [](const auto& folder) {
                  return std::make_unique<FaultyCamera>(file_camera(folder), std::vector<Fault>{});
                }},
        Backend{"AravisTriggered", [](const auto&) { return on_gige(); }},
        Backend{"AravisFreeRun",
                [](const auto&) { return on_gige({.trigger = AravisTrigger::kFreeRun, .rate_hz = 500.0}); }},
        Backend{"AravisWithoutChunks", [](const auto&) { return on_gige({}, {.chunks = false}); }},
        Backend{"AravisTwelveBits", [](const auto&) { return on_gige({.pixel_format = "Mono12"}); }},
        Backend{"AravisPacked", [](const auto&) { return on_gige({.pixel_format = "Mono10p"}); }},
        Backend{"AravisBayer", [](const auto&) { return on_gige({.pixel_format = "BayerRG8"}); }}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace slsd
