// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_camera.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <optional>
#include <thread>
#include <variant>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/camera/aravis/list_devices.hpp"
#include "drivers/camera/aravis/packet_socket.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/drivers/camera/gige_backend.hpp"
#include "tests/drivers/camera/recording.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::counter_of;
using test::far_away;
using test::options_for;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class AravisCameraTest : public ::testing::Test {
 protected:
  /// Opens, or says why not.
  static ::testing::AssertionResult opens(Camera& camera) {
    const auto opened = camera.open();
    return opened ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << to_string(opened.error());
  }

  /// The counter of the next frame; nothing if it failed or is not as it was sent.
  static std::optional<std::uint32_t> next(Camera& camera, int bits = 8) {
    const auto frame = camera.capture(far_away());
    EXPECT_TRUE(frame) << to_string(frame.error());
    return frame ? counter_of(frame->image(), bits) : std::nullopt;
  }

  /// Whether the next frame is whole, and of the exposure that the device made last.
  static bool next_is_newest(Camera& camera, const test::GigeCamera& device) {
    const auto counter = next(camera);
    return counter && *counter == device.frames_exposed() - 1;
  }

  static ErrorCode error_of(Camera& camera, MonotonicTime deadline = far_away()) {
    const auto frame = camera.capture(deadline);
    EXPECT_FALSE(frame);
    return frame ? ErrorCode{} : frame.error().code;
  }

  test::GigeCamera device_;
};

TEST_F(AravisCameraTest, TakesOneFrameToATrigger) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  const std::uint32_t before = device_.frames_exposed();
  for (std::uint32_t i = 0; i < 20; ++i) EXPECT_EQ(next(camera), before + i);
  EXPECT_EQ(device_.frames_exposed(), before + 20);
  EXPECT_EQ(camera.description().device, "Aravis-DOUBLE-1");
  EXPECT_EQ(camera.statistics().lost, 0u);
}

TEST_F(AravisCameraTest, SetsWhatIsConfiguredAndTurnsAutomaticsOff) {
  AravisCameraOptions options = options_for(device_);
  options.exposure_us = 5000.0;
  options.gain_db = 3.0;
  options.size_px = {32, 16};
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_EQ(device_.read_double(test::kExposureTime), 5000.0);
  EXPECT_EQ(device_.read_double(test::kGain), 3.0);
  EXPECT_EQ(device_.read(test::kExposureAuto), 0u);
  EXPECT_EQ(device_.read(test::kGainAuto), 0u);
  EXPECT_EQ(device_.read(test::kTriggerMode), 1u);
  EXPECT_EQ(std::pair(camera.description().width_px, camera.description().height_px), std::pair(32, 16));
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisCameraTest, RefusesASettingThatTheCameraDoesNotTake) {
  device_.hold(test::kExposureTime);
  AravisCamera camera(options_for(device_));
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(to_string(opened.error()), HasSubstr("ExposureTime: the camera took 123 where 10000 was set"));
}

TEST_F(AravisCameraTest, RefusesAPixelFormatThatTheCameraLacks) {
  AravisCameraOptions options = options_for(device_);
  options.pixel_format = "BayerGB8";
  AravisCamera camera(options);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(to_string(opened.error()), HasSubstr("PixelFormat: the camera has no BayerGB8"));
}

TEST_F(AravisCameraTest, ReadsDeepPixels) {
  for (const auto& [format, bits] : {std::pair("Mono10", 10), std::pair("Mono12", 12), std::pair("Mono16", 16)}) {
    AravisCameraOptions options = options_for(device_);
    options.pixel_format = format;
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    EXPECT_TRUE(next(camera, bits)) << format;
  }
}

TEST_F(AravisCameraTest, TurnsAMosaicIntoGrey) {
  test::GigeCameraOptions flat;
  flat.frames = test::replayed_images({Grey8(64, 48, 77)});
  test::GigeCamera device(flat);
  AravisCameraOptions options = options_for(device);
  options.pixel_format = "BayerRG8";
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  const auto frame = camera.capture(far_away());
  ASSERT_TRUE(frame);
  const auto& grey = std::get<ImageView<std::uint8_t>>(frame->image());
  EXPECT_EQ(std::count(grey.pixels, grey.pixels + 64 * 48, 77), 64 * 48);
}

TEST_F(AravisCameraTest, ExposesAtALine) {
  AravisCameraOptions options = options_for(device_);
  options.trigger = AravisTrigger::kLine;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_EQ(error_of(camera, steady_clock::now() + 50ms), ErrorCode::kFrameLate);
  std::uint32_t expected = device_.frames_exposed();
  // The frame of a pulse that came before the capture would be an old one.
  const std::jthread line([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(20ms)) device_.pulse_line();
  });
  for (int i = 0; i < 10; ++i) {
    const auto counter = next(camera);
    ASSERT_TRUE(counter);
    EXPECT_GE(*counter, expected);
    expected = *counter + 1;
  }
}

TEST_F(AravisCameraTest, PassesOverFramesOfALineThatNobodyWaitedFor) {
  AravisCameraOptions options = options_for(device_);
  options.trigger = AravisTrigger::kLine;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 5; ++i) device_.pulse_line();
  const std::uint32_t before = device_.frames_exposed();
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(error_of(camera, steady_clock::now() + 50ms), ErrorCode::kFrameLate);
  EXPECT_EQ(device_.frames_exposed(), before);
}

TEST_F(AravisCameraTest, TakesTheNextFrameWhereTheCameraRunsFreely) {
  AravisCameraOptions options = options_for(device_);
  options.trigger = AravisTrigger::kFreeRun;
  options.rate_hz = 200.0;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 10; ++i) {
    const MonotonicTime asked = steady_clock::now();
    const auto frame = camera.capture(far_away());
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_TRUE(counter_of(frame->image()));
    EXPECT_GE(frame->exposure_start(), asked);
    if (i == 5) std::this_thread::sleep_for(100ms);
  }
}

// The double's clock is 40 ppm fast, ticks 125 million times a second and began at 10 s.
TEST_F(AravisCameraTest, MapsTheDevicesClock) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 5; ++i) {
    const MonotonicTime asked = steady_clock::now();
    const auto frame = camera.capture(far_away());
    ASSERT_TRUE(frame);
    EXPECT_GE(frame->exposure_start(), asked);
    EXPECT_LT(frame->exposure_start(), frame->received());
    EXPECT_LE(frame->received(), steady_clock::now());
  }
}

TEST_F(AravisCameraTest, GetsLostPacketsAgain) {
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

TEST_F(AravisCameraTest, GivesUpAFrameWithHolesWhereNothingIsSentAgain) {
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

TEST_F(AravisCameraTest, SaysThatAFrameWasLostAndGoesOn) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 1000;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_EQ(camera.capture(far_away())->sequence(), 0u);
  device_.set_faults({.drop_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameDropped);
  const auto frame = camera.capture(far_away());
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->sequence(), 2u);
  EXPECT_EQ(camera.statistics().lost, 1u);
}

TEST_F(AravisCameraTest, RefusesAFrameThatEndsTooEarly) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.truncate_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameTorn);
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisCameraTest, RefusesAFrameExposedBeforeTheTrigger) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.stale_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameStale);
  EXPECT_EQ(camera.statistics().stale, 1u);
  EXPECT_TRUE(next(camera));
}

// The frame of the capture that was late comes later, and must not be taken for the next one's.
TEST_F(AravisCameraTest, DoesNotMixFramesAfterAStall) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 200;
  options.missed_frames_max = 100;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.stall(700ms);
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

TEST_F(AravisCameraTest, KeepsALateFrameFromTheNextCapture) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.stall(1000ms);
  EXPECT_EQ(error_of(camera, steady_clock::now() + 100ms), ErrorCode::kFrameLate);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisCameraTest, IsDisconnectedWhenTheCameraSendsNothing) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 400;
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

TEST_F(AravisCameraTest, HoldsUpNoCaptureWhenTheCameraIsGone) {
  AravisCameraOptions options = options_for(device_);
  options.frame_timeout_ms = 1000;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.gone = true});
  EXPECT_EQ(error_of(camera, steady_clock::now() + 100ms), ErrorCode::kFrameLate);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);
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

TEST_F(AravisCameraTest, IsBackAfterAPowerFailureWithEverySetting) {
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

TEST_F(AravisCameraTest, RefusesACameraThatAnotherControls) {
  AravisCamera first(options_for(device_));
  ASSERT_TRUE(opens(first));
  AravisCamera second(options_for(device_));
  const auto opened = second.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kPermissionDenied);
  EXPECT_THAT(to_string(opened.error()), HasSubstr("another application controls the camera"));
  EXPECT_TRUE(next(first));
}

TEST_F(AravisCameraTest, IsDisconnectedWhenAnotherTakesControl) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.occupy(true);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);
  EXPECT_EQ(camera.open().error().code, ErrorCode::kPermissionDenied);
  device_.occupy(false);
  ASSERT_TRUE(opens_again(camera));
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisCameraTest, NamesAnAddressWhereNothingAnswers) {
  AravisCameraOptions options = options_for(device_);
  options.id = "127.78.0.1";
  AravisCamera camera(options);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(to_string(opened.error()), HasSubstr("127.78.0.1: no camera answers"));
}

TEST_F(AravisCameraTest, RefusesAnInterfaceThatThisHostLacks) {
  AravisCameraOptions options = options_for(device_);
  options.interface = "192.0.2.77";
  AravisCamera camera(options);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(AravisCameraTest, FindsACameraByItsSerialNumber) {
  test::GigeCameraOptions named;
  named.serial = "S" + std::to_string(steady_clock::now().time_since_epoch().count() % 1'000'000'000);
  test::GigeCamera device(named);
  const auto listed = list_aravis_devices();
  const auto has_serial = [&](const AravisDevice& seen) { return seen.serial == named.serial; };
  if (std::ranges::none_of(listed, has_serial)) GTEST_SKIP() << "this host passes no broadcast on to itself";
  for (const std::string& id : {named.serial, "Aravis-" + named.serial}) {
    AravisCameraOptions options = options_for(device);
    options.id = id;
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    EXPECT_TRUE(next(camera));
  }
}

TEST_F(AravisCameraTest, WarnsOfAReceiveBufferThatTheSystemDoesNotAllow) {
  AravisCameraOptions options = options_for(device_);
  options.receive_buffer_bytes = 1 << 30;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_THAT(camera.warnings(), Contains("receive_buffer"));
  EXPECT_THAT(camera.warnings(), Not(Contains("packet_resend")));
}

TEST_F(AravisCameraTest, TakesPacketsBeforeTheSocketWhereItMay) {
  if (!packet_socket_allowed()) GTEST_SKIP() << "needs CAP_NET_RAW";
  AravisCameraOptions options = options_for(device_);
  options.packet_socket = true;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(next(camera));
}

TEST_F(AravisCameraTest, FindsTheLargestPacketThatGetsThrough) {
  test::GigeCameraOptions narrow;
  narrow.packet_bytes_max = 1500;
  test::GigeCamera device(narrow);
  AravisCameraOptions options = options_for(device);
  options.packet_bytes = 0;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_LE(device.read(test::kStreamPacketSize) & 0xffff, 1500u);
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisCameraTest, WorksBesideAnotherCamera) {
  test::GigeCamera other_device;
  AravisCamera camera(options_for(device_));
  AravisCamera other(options_for(other_device));
  ASSERT_TRUE(opens(camera));
  ASSERT_TRUE(opens(other));
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(next_is_newest(camera, device_));
    EXPECT_TRUE(next_is_newest(other, other_device));
  }
}

TEST_F(AravisCameraTest, AllocatesNothingPerFrame) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(next(camera));
  const std::uint64_t before = test::allocations();
  bool sound = true;
  for (int i = 0; i < 40; ++i) sound = sound && camera.capture(far_away()).has_value();
  EXPECT_TRUE(sound);
  EXPECT_EQ(test::allocations(), before);
}

std::ptrdiff_t open_descriptors() {
  const std::filesystem::directory_iterator descriptors("/proc/self/fd");
  return std::distance(begin(descriptors), end(descriptors));
}

TEST_F(AravisCameraTest, LeavesNoDescriptorBehind) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  const std::ptrdiff_t before = open_descriptors();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(opens(camera));
  EXPECT_EQ(open_descriptors(), before);
  EXPECT_EQ(device_.times_taken(), 11);
}

}  // namespace
}  // namespace slsd
