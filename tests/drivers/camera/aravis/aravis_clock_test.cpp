// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "tests/drivers/camera/aravis/aravis_test.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::ClockFault;
using test::counter_of;
using test::far_away;
using test::options_for;
using ::testing::Contains;
using ::testing::Not;

/// Clocks that cannot be trusted, and how a camera begins.
class AravisClockTest : public test::AravisTest {
 protected:
  static test::GigeCameraOptions with_clock(ClockFault fault) {
    test::GigeCameraOptions device;
    device.clock_fault = fault;
    device.readout = 2ms;
    return device;
  }

  static AravisCameraOptions free_run(const test::GigeCamera& device) {
    AravisCameraOptions options = options_for(device);
    options.trigger = AravisTrigger::kFreeRun;
    options.rate_hz = 50.0;
    return options;
  }

  /// Takes a frame whose exposure truly began after it was asked for, by what the double knows of it.
  static ::testing::AssertionResult takes_fresh(Camera& camera, const test::GigeCamera& device) {
    const auto asked = steady_clock::now();
    const auto frame = camera.capture(far_away());
    if (!frame) return ::testing::AssertionFailure() << to_string(frame.error());
    const auto counter = counter_of(frame->image());
    if (!counter) return ::testing::AssertionFailure() << "the frame is not as it was sent";
    const auto early = asked - device.exposure_of(*counter);
    if (early <= 0s && frame->exposure_start() <= device.exposure_of(*counter) + 1ms)
      return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "exposed " << early / 1us << " us before it was asked for";
  }
};

constexpr ClockFault kFaults[] = {ClockFault::kStandsStill, ClockFault::kOtherEpoch, ClockFault::kOtherRate,
                                  ClockFault::kGoesBack};

TEST_F(AravisClockTest, GoesByTheArrivalOfFramesAtACommand) {
  for (const ClockFault fault : kFaults) {
    test::GigeCamera device(with_clock(fault));
    AravisCamera camera(options_for(device));
    ASSERT_TRUE(opens(camera));
    EXPECT_THAT(camera.warnings(), Contains("device_clock")) << static_cast<int>(fault);
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(takes_fresh(camera, device)) << static_cast<int>(fault);
  }
}

TEST_F(AravisClockTest, GoesByTheArrivalOfFramesWhereTheCameraRunsFreely) {
  for (const ClockFault fault : kFaults) {
    test::GigeCamera device(with_clock(fault));
    AravisCamera camera(free_run(device));
    ASSERT_TRUE(opens(camera));
    EXPECT_THAT(camera.warnings(), Contains("device_clock")) << static_cast<int>(fault);
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(takes_fresh(camera, device)) << static_cast<int>(fault);
  }
}

TEST_F(AravisClockTest, TrustsAGoodClock) {
  test::GigeCamera device(with_clock(ClockFault::kNone));
  for (const AravisCameraOptions& options : {options_for(device), free_run(device)}) {
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(takes_fresh(camera, device));
    EXPECT_THAT(camera.warnings(), Not(Contains("device_clock")));
  }
}

TEST_F(AravisClockTest, GoesByArrivalWhereToldTo) {
  test::GigeCamera device(with_clock(ClockFault::kNone));
  for (AravisCameraOptions options : {options_for(device), free_run(device)}) {
    options.device_clock = AravisClock::kArrival;
    AravisCamera camera(options);
    ASSERT_TRUE(opens(camera));
    EXPECT_THAT(camera.warnings(), Not(Contains("device_clock")));
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(takes_fresh(camera, device));
  }
}

TEST_F(AravisClockTest, GoesByAClockThatCannotBeTrustedWhereToldTo) {
  test::GigeCamera device(with_clock(ClockFault::kStandsStill));
  AravisCameraOptions options = options_for(device);
  options.device_clock = AravisClock::kDevice;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(error_of(camera), ErrorCode::kFrameStale);
  EXPECT_EQ(error_of(camera), ErrorCode::kDisconnected);  // in vain, but open again it may be another clock
}

// What a network holds up comes in a burst, and each frame seems to be of a moment ago.
TEST_F(AravisClockTest, TakesNoFrameThatWasHeldUpForAFreshOne) {
  test::GigeCamera device(with_clock(ClockFault::kOtherEpoch));
  AravisCamera camera(free_run(device));
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(takes_fresh(camera, device));
  device.stall(300ms);
  std::this_thread::sleep_for(200ms);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(takes_fresh(camera, device));
  std::this_thread::sleep_for(1s);  // more frames than there are buffers
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(takes_fresh(camera, device));
}

// The next one may be seconds away, and is not missing.
TEST_F(AravisClockTest, WaitsForAFrameThatIsFreshForCertain) {
  test::GigeCamera device(with_clock(ClockFault::kStandsStill));
  AravisCameraOptions options = free_run(device);
  options.frame_timeout_ms = 500;
  options.readout_us = 1.5e6;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(takes_fresh(camera, device));
  EXPECT_EQ(error_of(camera, steady_clock::now() + 700ms), ErrorCode::kFrameLate);
  EXPECT_GE(camera.frame_time_max(), 1500ms + 5s);
}

// The double without a readout sends a frame as soon as its exposure begins, as simulated cameras do.
TEST_F(AravisClockTest, TakesFramesOfACameraThatDoesNotExposeAsLongAsItSays) {
  test::GigeCameraOptions simulated;
  simulated.clock_fault = ClockFault::kStandsStill;
  test::GigeCamera device(simulated);
  AravisCameraOptions options = options_for(device);
  options.exposure_us = 50000.0;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(takes_fresh(camera, device));
  device.set_faults({.extra_frames = 1});
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(takes_fresh(camera, device));
}

TEST_F(AravisClockTest, NoticesAClockThatFailsLater) {
  test::GigeCamera device(with_clock(ClockFault::kNone));
  AravisCamera camera(options_for(device));
  ASSERT_TRUE(opens(camera));
  device.set_clock_fault(ClockFault::kStandsStill);
  for (int i = 0; i < 3000 && camera.warnings().empty(); ++i) {
    (void)camera.capture(far_away());
    std::this_thread::sleep_for(10ms);
    if (!camera.check()) {
      ASSERT_TRUE(opens(camera));
    }
  }
  EXPECT_THAT(camera.warnings(), Contains("device_clock"));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(takes_fresh(camera, device));
}

int from_environment(const char* name, int otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

// By less than what is known of the camera's clock: the frame may be of before, so it is none of those asked for.
TEST_F(AravisClockTest, GivesNoFrameThatALineBeganJustBefore) {
  test::GigeCamera device(with_clock(ClockFault::kNone));
  AravisCameraOptions options = options_for(device);
  options.trigger = AravisTrigger::kLine;
  AravisCamera camera(options);
  ASSERT_TRUE(opens(camera));
  for (int i = 0; i < 60; ++i) {
    device.pulse_line();
    const auto asked = steady_clock::now();
    const std::jthread later([&] {
      std::this_thread::sleep_for(20ms);
      device.pulse_line();
    });
    const auto frame = camera.capture(far_away());
    if (!frame) {
      EXPECT_EQ(frame.error().code, ErrorCode::kFrameStale);
      continue;
    }
    const auto counter = counter_of(frame->image());
    ASSERT_TRUE(counter);
    EXPECT_GE(device.exposure_of(*counter), asked) << i;
  }
}

// SLSD_TEST_OPENINGS=100 SLSD_TEST_FRAMES=1000 for the figure.
TEST_F(AravisClockTest, GivesEachFirstFrameWhereNumbersStartAgain) {
  const int openings = from_environment("SLSD_TEST_OPENINGS", 3);
  const int frames = from_environment("SLSD_TEST_FRAMES", 20);
  test::GigeCameraOptions anew;
  anew.restarts_ids = true;
  anew.arming = 100us;
  anew.width_px = 640;
  anew.height_px = 480;
  test::GigeCamera device(anew);
  device.lose_packets(0.01, 5);
  const std::jthread line([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(50ms)) device.pulse_line();
  });
  for (const auto trigger :
       {AravisTrigger::kSoftware, AravisTrigger::kFreeRun, AravisTrigger::kLine, AravisTrigger::kAction}) {
    AravisCameraOptions options = options_for(device);
    options.trigger = trigger;
    options.rate_hz = trigger == AravisTrigger::kFreeRun ? 50.0 : 0.0;
    int first = 0;
    int more = 0;
    AravisCamera camera(options);
    for (int i = 0; i < openings; ++i) {
      ASSERT_TRUE(opens(camera));
      EXPECT_EQ(camera.statistics().lost, 0u);
      const auto fresh = takes_fresh(camera, device);
      EXPECT_TRUE(fresh) << "opening " << i << " of trigger " << static_cast<int>(trigger);
      if (fresh) ++first;
    }
    for (int i = 0; i < frames; ++i) {
      const auto fresh = takes_fresh(camera, device);
      EXPECT_TRUE(fresh) << "frame " << i << " of trigger " << static_cast<int>(trigger);
      if (fresh) ++more;
    }
    EXPECT_EQ(first, openings) << static_cast<int>(trigger);
    EXPECT_EQ(more, frames) << static_cast<int>(trigger);
    if (openings > 3)
      std::printf("trigger %d: %d of %d first frames, %d of %d more\n", static_cast<int>(trigger), first, openings,
                  more, frames);
  }
}

}  // namespace
}  // namespace slsd
