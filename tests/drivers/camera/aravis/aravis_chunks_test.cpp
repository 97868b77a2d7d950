// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <thread>
#include <utility>

#include <gmock/gmock.h>

#include "tests/drivers/camera/aravis/aravis_test.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::far_away;
using test::options_for;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// What a camera says of each frame.
class AravisChunksTest : public test::AravisTest {
 protected:
  static Error failure_of(Camera& camera) {
    const auto frame = camera.capture(far_away());
    EXPECT_FALSE(frame);
    return frame ? Error{} : frame.error();
  }

  static AravisCameraOptions at_a_line(const test::GigeCamera& device) {
    AravisCameraOptions options = options_for(device);
    options.trigger = AravisTrigger::kLine;
    return options;
  }
};

TEST_F(AravisChunksTest, AsksForWhatTellsOfTheExposure) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  for (const auto chunk :
       {test::kChunkMode, test::kChunkTimestampEnable, test::kChunkExposureTimeEnable, test::kChunkGainEnable})
    EXPECT_EQ(device_.read(chunk), 1u) << chunk;
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(next(camera));
  EXPECT_THAT(camera.warnings(), Not(Contains("chunks")));
}

// Payload type 5 of GigE Vision 1, of which Aravis reads the image only.
TEST_F(AravisChunksTest, GoesWithoutWhereTheFrameIsOfTheOlderKind) {
  test::GigeCameraOptions older;
  older.chunk_payload = 0x0005;
  test::GigeCamera device(older);
  AravisCamera camera(options_for(device));
  ASSERT_TRUE(opens(camera));
  EXPECT_THAT(camera.warnings(), Contains("chunks"));
  EXPECT_EQ(device.read(test::kChunkMode), 0u);
  EXPECT_TRUE(next_is_newest(camera, device));
}

TEST_F(AravisChunksTest, LeavesThemOffWhereConfiguredSo) {
  AravisCameraOptions options = options_for(device_);
  {
    AravisCamera before(options);
    ASSERT_TRUE(opens(before));
    EXPECT_EQ(device_.read(test::kChunkMode), 1u);
  }
  options.chunks = false;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  EXPECT_EQ(device_.read(test::kChunkMode), 0u);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisChunksTest, DoesWithoutWhereTheCameraHasNone) {
  test::GigeCameraOptions plain;
  plain.chunks = false;
  test::GigeCamera device(plain);
  AravisCamera camera(options_for(device));
  ASSERT_TRUE(opens(camera));
  EXPECT_TRUE(next_is_newest(camera, device));
  EXPECT_EQ(device.read(test::kChunkMode), 0u);
  EXPECT_THAT(camera.warnings(), Not(Contains("chunks")));
}

TEST_F(AravisChunksTest, DoesWithoutOneThatTheCameraRefuses) {
  device_.hold(test::kChunkExposureTimeEnable);
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  EXPECT_EQ(device_.read(test::kChunkExposureTimeEnable), 0u);
  device_.set_faults({.misexposed_frames = 1});
  EXPECT_TRUE(next(camera));
  device_.set_faults({.misgained_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kMismatch);
}

TEST_F(AravisChunksTest, RefusesAFrameOfAnotherExposure) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.misexposed_frames = 1});
  const Error error = failure_of(camera);
  EXPECT_EQ(error.code, ErrorCode::kMismatch);
  EXPECT_THAT(error.message, HasSubstr("its exposure was 20000 us, but 10000 is configured"));
  EXPECT_EQ(camera.statistics().misexposed, 1u);
  EXPECT_TRUE(next_is_newest(camera, device_));
  EXPECT_EQ(camera.statistics().lost, 0u);
}

TEST_F(AravisChunksTest, RefusesAFrameOfAnotherGain) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.misgained_frames = 1});
  EXPECT_THAT(failure_of(camera).message, HasSubstr("its gain was 1 dB, but 0 is configured"));
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisChunksTest, RefusesAFrameThatEndsWithinItsChunks) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.short_chunk_frames = 1});
  EXPECT_EQ(error_of(camera), ErrorCode::kFrameTorn);
  EXPECT_EQ(camera.statistics().torn, 1u);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisChunksTest, RefusesAFrameWithNoiseForChunks) {
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  device_.set_faults({.garbage_chunk_frames = 1});
  const Error error = failure_of(camera);
  EXPECT_EQ(error.code, ErrorCode::kFrameTorn);
  EXPECT_THAT(error.message, HasSubstr("set chunks = false"));
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisChunksTest, GoesWithoutWhereItCannotReadThem) {
  device_.set_faults({.garbage_chunk_frames = 3});
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  EXPECT_THAT(camera.warnings(), Contains("chunks"));
  EXPECT_EQ(device_.read(test::kChunkMode), 0u);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

TEST_F(AravisChunksTest, KeepsThemWhereOnlyTheFirstFrameIsBroken) {
  device_.set_faults({.garbage_chunk_frames = 1});
  AravisCamera camera(options_for(device_));
  ASSERT_TRUE(opens(camera));
  EXPECT_THAT(camera.warnings(), Not(Contains("chunks")));
  EXPECT_EQ(device_.read(test::kChunkMode), 1u);
  EXPECT_TRUE(next_is_newest(camera, device_));
}

// By the frame's own time stamp this one would be fresh.
TEST_F(AravisChunksTest, TellsByThemWhenTheExposureBegan) {
  for (const bool in_ns : {false, true}) {
    test::GigeCameraOptions slow;
    slow.stamp_delay = 400ms;
    slow.chunks_in_ns = in_ns;
    test::GigeCamera device(slow);
    AravisCamera camera(options_for(device));
    ASSERT_TRUE(opens(camera));
    device.stall(450ms);
    const auto frame = camera.capture(far_away());
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_LT(std::chrono::abs(frame->exposure_start() - device.last_exposure()), 200ms);
  }
}

TEST_F(AravisChunksTest, ReadsPackedAndDeepPixelsBeforeThem) {
  for (const auto& [format, bits] : {std::pair("Mono10p", 10), std::pair("Mono12", 12)}) {
    AravisCameraOptions options = options_for(device_);
    options.pixel_format = format;
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    EXPECT_TRUE(next(camera, bits)) << format;
    device_.set_faults({.misexposed_frames = 1});
    EXPECT_EQ(error_of(camera), ErrorCode::kMismatch);
    EXPECT_TRUE(next(camera, bits)) << format;
  }
}

TEST_F(AravisChunksTest, SaysThatNothingProvesTheFirstFrameAtALine) {
  test::GigeCameraOptions wired;
  wired.software_trigger = false;
  test::GigeCamera device(wired);
  AravisCamera camera(at_a_line(device));
  ASSERT_TRUE(opens(camera));
  EXPECT_THAT(camera.warnings(), Contains("first_frame"));
  EXPECT_EQ(device.frames_exposed(), 0u);
  const std::jthread line([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(20ms)) device.pulse_line();
  });
  EXPECT_TRUE(next(camera));
}

TEST_F(AravisChunksTest, ProvesTheFirstFrameAtALineByACommand) {
  AravisCamera camera(at_a_line(device_));
  ASSERT_TRUE(opens(camera));
  EXPECT_THAT(camera.warnings(), Not(Contains("first_frame")));
  EXPECT_GE(device_.frames_exposed(), 1u);
}

}  // namespace
}  // namespace slsd
