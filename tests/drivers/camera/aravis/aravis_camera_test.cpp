// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_camera.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <thread>
#include <variant>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/camera/aravis/gige/configure_network.hpp"
#include "drivers/camera/aravis/gige/gige_discovery.hpp"
#include "drivers/system/file_descriptor.hpp"
#include "tests/doubles/gige/device_socket.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/drivers/camera/aravis/aravis_test.hpp"

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

using AravisCameraTest = test::AravisTest;

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
  EXPECT_THAT(to_string(opened.error()), HasSubstr("ExposureTime: the camera set 123 instead of 10000"));
}

// Each frame's chunk has its exposure, and another than the one set would be an error.
TEST_F(AravisCameraTest, ChangesTheExposureWhileItRuns) {
  for (const AravisTrigger trigger : {AravisTrigger::kSoftware, AravisTrigger::kFreeRun}) {
    AravisCameraOptions options = options_for(device_);
    options.trigger = trigger;
    options.exposure_us = 1000;
    options.rate_hz = trigger == AravisTrigger::kFreeRun ? 100 : 0;
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    for (int i = 0; i < 6; ++i) {
      const double exposure_us = i % 2 == 0 ? 4000 : 1000;
      const auto set = camera.set_exposure(exposure_us);
      ASSERT_TRUE(set) << to_string(set.error());
      EXPECT_EQ(device_.read_double(test::kExposureTime), exposure_us);
      const auto asked = std::chrono::steady_clock::now();
      const auto frame = camera.capture(far_away());
      ASSERT_TRUE(frame) << to_string(frame.error());
      EXPECT_GE(frame->exposure_start(), asked);
    }
    EXPECT_EQ(camera.set_exposure(2e6).error().code, ErrorCode::kInvalidArgument);
    EXPECT_TRUE(next(camera)) << "as before";
  }
  AravisCamera camera(options_for(device_));
  EXPECT_EQ(camera.set_exposure(4000).error().code, ErrorCode::kDisconnected);
  ASSERT_TRUE(opens(camera));
  device_.hold(test::kExposureTime);
  EXPECT_EQ(camera.set_exposure(4000).error().code, ErrorCode::kMismatch);
}

// Which the double, as many a camera, takes in silence.
TEST_F(AravisCameraTest, RefusesWhatIsBeyondTheRangeThatTheCameraTells) {
  for (const bool exposure : {true, false}) {
    AravisCameraOptions options = options_for(device_);
    (exposure ? options.exposure_us : options.gain_db) = exposure ? 2e6 : 30.0;
    AravisCamera camera(options);
    const auto opened = camera.open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(to_string(opened.error()),
                HasSubstr(exposure ? "ExposureTime: the camera takes 10 to 1000000, not 2000000"
                                   : "Gain: the camera takes 0 to 24, not 30"));
  }
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
  for (const auto& [format, bits] :
       {std::pair("Mono10", 10), std::pair("Mono12", 12), std::pair("Mono16", 16), std::pair("Mono10p", 10),
        std::pair("Mono12p", 12), std::pair("Mono10Packed", 10), std::pair("Mono12Packed", 12)}) {
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

TEST_F(AravisCameraTest, GivesTheColoursOfAMosaicWithoutThePattern) {
  Grey8 mosaic(64, 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) mosaic.at(x, y) = static_cast<std::uint8_t>(40 * (1 + x % 2 + y % 2));
  test::GigeCameraOptions even;
  even.frames = test::replayed_images({mosaic});
  test::GigeCamera device(even);
  AravisCameraOptions options = options_for(device);
  options.pixel_format = "BayerRG8";
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_TRUE(camera.capture(far_away())->colours()->empty());
  camera.expect(Picture::kWhite);
  const auto frame = camera.capture(far_away());
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->colours(), ColourFrame(64, 48, {40, 80, 120}));
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

TEST_F(AravisCameraTest, FindsACameraByItsSerialNumber) {
  test::GigeCameraOptions named;
  named.serial = "S" + std::to_string(steady_clock::now().time_since_epoch().count() % 1'000'000'000);
  test::GigeCamera device(named);
  const auto has_serial = [&](const GigeDevice& seen) { return seen.serial == named.serial; };
  if (std::ranges::none_of(discover_gige_devices(1s, has_serial), has_serial))
    GTEST_SKIP() << "this host passes no broadcast on to itself";
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

// Until its filter is there, such a socket hears the whole interface.
TEST_F(AravisCameraTest, TakesNoPacketsOfOthersThatAreOpenedMeanwhile) {
  if (!packet_socket_allowed()) GTEST_SKIP() << "needs CAP_NET_RAW";
  std::vector<std::jthread> others;
  for (int i = 0; i < 2; ++i)
    others.emplace_back([](const std::stop_token& stop) {
      test::GigeCamera device;
      for (; !stop.stop_requested(); std::this_thread::sleep_for(50ms)) {
        AravisCamera other(options_for(device));
        EXPECT_TRUE(opens(other));
        EXPECT_TRUE(next(other));
      }
    });
  AravisCameraOptions options = options_for(device_);
  options.packet_socket = true;
  for (int i = 0; i < 40; ++i) {
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(next_is_newest(camera, device_)) << "opening " << i << ", frame " << k;
  }
}

TEST_F(AravisCameraTest, PassesOverPacketsThatAreOfNoFrame) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  const FileDescriptor stranger(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const sockaddr_in stream =
      test::socket_address(htonl(INADDR_LOOPBACK), static_cast<std::uint16_t>(device_.read(test::kStreamPort)));
  for (int i = 0; i < 40; ++i) {
    const std::array<unsigned char, 16> packet{0, 0, 200, 1};  // of frame 51201, and of no kind
    ASSERT_EQ(::sendto(stranger.number(), packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&stream),
                       sizeof(stream)),
              16);
    EXPECT_TRUE(next_is_newest(camera, device_)) << "frame " << i;
  }
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

/// Without pipes: Aravis opens none, and a sanitizer's lead to what names functions for it.
std::vector<std::string> open_descriptors() {
  std::vector<std::string> open;
  for (const auto& descriptor : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;  // the iterator's own
    const std::string target = std::filesystem::read_symlink(descriptor, gone).string();
    // Of a socket or an event descriptor the kind alone: each opening makes new ones.
    if (!target.starts_with("pipe:")) open.push_back(target.substr(0, target.find(":[")));
  }
  std::ranges::sort(open);
  return open;
}

TEST_F(AravisCameraTest, LeavesNoDescriptorBehind) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  const std::vector<std::string> before = open_descriptors();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(opens(camera));
  EXPECT_EQ(open_descriptors(), before);
  EXPECT_EQ(device_.times_taken(), 11);
}

}  // namespace
}  // namespace slsd
