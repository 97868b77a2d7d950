// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "tests/drivers/camera/aravis/aravis_test.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::counter_of;
using test::far_away;
using test::options_for;
using ::testing::HasSubstr;

/// What a camera on a network does wrong, and what another application does.
using AravisFaultsTest = test::AravisTest;

TEST_F(AravisFaultsTest, GetsLostPacketsAgain) {
  test::GigeCameraOptions large;
  large.width_px = 640;
  large.height_px = 480;
  test::GigeCamera device(large);
  device.lose_packets(0.01, 7);
  AravisCameraOptions options = options_for(device);
  options.frame_timeout_ms = 30000;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  const std::uint32_t before = device.frames_exposed();
  for (std::uint32_t i = 0; i < 50; ++i) EXPECT_EQ(next(camera), before + i);
  EXPECT_GT(device.packets_lost(), 50u);
  EXPECT_GT(camera.statistics().packets_sent_again, 50u);
}

TEST_F(AravisFaultsTest, GivesUpAFrameWithHolesWhereNothingIsSentAgain) {
  AravisCameraOptions options = options_for(device_);
  options.packet_resend = false;
  options.frame_timeout_ms = 2000;
  options.missed_frames_max = 100;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.lose_packets(0.2, 3);
  int torn = 0;
  for (int i = 0; i < 10 && torn == 0; ++i) {
    const auto frame = camera.capture(far_away());
    EXPECT_TRUE(!frame || counter_of(frame->image()));
    if (!frame && frame.error().code == ErrorCode::kFrameTorn) ++torn;
  }
  EXPECT_GT(torn, 0);
  device_.lose_packets(0.0);
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisFaultsTest, SaysThatAFrameWasLostAndGoesOn) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 2500;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  const auto first = camera.capture(far_away());
  ASSERT_TRUE(first) << to_string(first.error());
  EXPECT_EQ(first->sequence(), 0u);
  device_.set_faults({.drop_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameDropped);
  const auto frame = camera.capture(far_away());
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->sequence(), 2u);
  EXPECT_EQ(camera.statistics().lost, 1u);
}

TEST_F(AravisFaultsTest, BeginsItsStreamAnewWhereTheFirstFrameDoesNotCome) {
  device_.set_faults({.drop_frames = 1});
  AravisCamera camera(options_for(device_));
  const auto begin = steady_clock::now();
  ASSERT_TRUE(opens(camera));
  EXPECT_GE(steady_clock::now() - begin, 250ms);
  const std::uint32_t before = device_.frames_exposed();
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(next(camera), before + i);
  EXPECT_EQ(camera.statistics().lost, 0u);
  const auto warnings = camera.warnings();
  EXPECT_EQ(std::set<std::string>(warnings.begin(), warnings.end()).size(), warnings.size());
}

TEST_F(AravisFaultsTest, EndsItsOpeningWhenCancelled) {
  device_.set_faults({.silent = true});
  AravisCamera camera(options_for(device_));
  auto opened = std::async(std::launch::async, [&] { return camera.open(); });
  while (device_.frames_exposed() == 0) std::this_thread::sleep_for(1ms);
  camera.cancel();
  const auto result = opened.get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  device_.set_faults({});
  ASSERT_TRUE(opens(camera));
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisFaultsTest, RefusesAFrameThatEndsTooEarly) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.truncate_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameTorn);
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisFaultsTest, RefusesAFrameExposedBeforeTheTrigger) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.stale_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameStale);
  EXPECT_EQ(camera.statistics().stale, 1u);
  EXPECT_TRUE(next(camera));
}

// Each capture would get the frame of the trigger before, for ever.
TEST_F(AravisFaultsTest, GetsInStepAgainAfterAFrameTooMany) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  EXPECT_TRUE(next(camera));
  device_.set_faults({.extra_frames = 1});
  EXPECT_TRUE(camera.capture(far_away()));
  int stale = 0;
  for (int i = 0; i < 10; ++i) {
    const auto frame = camera.capture(far_away());
    EXPECT_TRUE(frame || frame.error().code == ErrorCode::kFrameStale);
    stale += frame ? 0 : 1;
  }
  EXPECT_LE(stale, 1);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

// The frame of the capture that was late comes later, and must not be taken for the next one's.
TEST_F(AravisFaultsTest, DoesNotMixFramesAfterAStall) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 1200;
  options.missed_frames_max = 100;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.stall(2000ms);
  int late = 0;
  std::optional<std::uint32_t> counter;
  while (!counter && late < 100) {
    const auto frame = camera.capture(far_away());
    if (frame)
      counter = counter_of(frame->image());
    else
      ++late;
  }
  EXPECT_GT(late, 0);
  EXPECT_EQ(counter, device_.frames_exposed() - 1);
}

TEST_F(AravisFaultsTest, KeepsALateFrameFromTheNextCapture) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.stall(1000ms);
  EXPECT_EQ(error_of(camera, steady_clock::now() + 100ms), ErrorCode::kFrameLate);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisFaultsTest, IsDisconnectedWhenTheCameraSendsNothing) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 1500;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.silent = true});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameDropped);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(opened.error().message, HasSubstr("sends no frame"));
  device_.set_faults({});
  ASSERT_TRUE(opens(camera));
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisFaultsTest, HoldsUpNoCaptureWhenTheCameraIsGone) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 1000;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.gone = true});
  const auto begin = steady_clock::now();
  EXPECT_EQ(error_of(camera, begin + 100ms), ErrorCode::kFrameLate);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);
  EXPECT_LT(steady_clock::now() - begin, 3s);  // waiting for the device to answer would take five
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
  device_.set_faults({});
}

/// Opens as the supervisor does, until it succeeds.
bool opens_again(Camera& camera) {
  for (int i = 0; i < 200; ++i) {
    if (camera.open()) return true;
    std::this_thread::sleep_for(50ms);
  }
  return false;
}

TEST_F(AravisFaultsTest, IsBackAfterAPowerFailureWithEverySetting) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 500;
  options.exposure_us = 4000.0;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_TRUE(next(camera));
  device_.blip(300ms);
  ErrorCode code{};
  for (int i = 0; i < 5 && code != ErrorCode::kDisconnected; ++i) code = error_of(camera);
  EXPECT_EQ(code, ErrorCode::kDisconnected);
  ASSERT_TRUE(opens_again(camera));
  EXPECT_EQ(device_.read_double(test::kExposureTime), 4000.0);
  EXPECT_EQ(device_.read(test::kExposureAuto), 0u);
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisFaultsTest, RefusesACameraThatAnotherControls) {
  AravisCamera first(options_for(device_));
  ASSERT_TRUE(opens(first));
  AravisCamera second(options_for(device_));
  const auto opened = second.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kPermissionDenied);
  EXPECT_THAT(to_string(opened.error()), HasSubstr("another application controls the camera"));
  EXPECT_TRUE(next(first));
}

TEST_F(AravisFaultsTest, IsDisconnectedWhenAnotherTakesControl) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.occupy(true);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);
  EXPECT_EQ(camera.open().error().code, ErrorCode::kPermissionDenied);
  device_.occupy(false);
  ASSERT_TRUE(opens_again(camera));
  EXPECT_TRUE(next(camera));
}

// A camera that dies while its description is read keeps Aravis waiting for seconds.
TEST_F(AravisFaultsTest, HoldsUpNoOtherCameraWhenItDiesWhileOpening) {
  device_.set_faults({.dies_after = 30});
  test::GigeCamera other_device;
  AravisCamera camera(options_for(device_));
  auto opened = std::async(std::launch::async, [&] { return camera.open(); });
  while (!device_.is_gone()) std::this_thread::sleep_for(1ms);
  AravisCamera other(options_for(other_device));
  auto other_opened = std::async(std::launch::async, [&] { return other.open(); });
  while (other_device.times_taken() == 0 && other_opened.wait_for(1ms) == std::future_status::timeout) continue;
  EXPECT_EQ(opened.wait_for(0s), std::future_status::timeout);
  EXPECT_TRUE(other_opened.get());
  EXPECT_FALSE(opened.get());
  EXPECT_TRUE(next(other));
}

TEST_F(AravisFaultsTest, OpensManyCamerasAtOnce) {
  constexpr int kCameras = 6;
  std::vector<std::unique_ptr<test::GigeCamera>> devices;
  std::vector<std::future<bool>> opened;
  for (int i = 0; i < kCameras; ++i) devices.push_back(std::make_unique<test::GigeCamera>());
  for (const auto& device : devices)
    opened.push_back(std::async(std::launch::async, [&device] {
      for (int i = 0; i < 3; ++i)
        if (AravisCamera camera(options_for(*device)); !camera.open() || !camera.capture(far_away())) return false;
      return true;
    }));
  for (auto& one : opened) EXPECT_TRUE(one.get());
}

TEST_F(AravisFaultsTest, NamesAnAddressWhereNothingAnswers) {
  AravisCameraOptions options = options_for(device_);
  options.id = "127.78.0.1";
  AravisCamera camera(options);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(to_string(opened.error()), HasSubstr("127.78.0.1: no camera answers"));
}

TEST_F(AravisFaultsTest, RefusesAnInterfaceThatThisHostLacks) {
  AravisCameraOptions options = options_for(device_);
  options.interface = "192.0.2.77";
  AravisCamera camera(options);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace slsd
