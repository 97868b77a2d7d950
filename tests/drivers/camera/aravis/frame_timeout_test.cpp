// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_camera_options.hpp"

#include <gtest/gtest.h>

#include "drivers/camera/aravis/aravis_camera.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;

AravisCameraOptions slowest() {
  AravisCameraOptions options;
  options.id = "S77";
  options.frame_timeout_ms = 60000;
  options.exposure_us = 1e7;
  options.action_lead_us = 1e6;
  options.ptp = true;
  options.rate_hz = 0.01;
  EXPECT_TRUE(options.validate());
  return options;
}

TEST(FirstFrameTimeout, IsSecondsBeyondTheExposureAndThePeriodWhereThatPaces) {
  for (int tries = 0; tries < kFirstFrameTries; ++tries) {
    EXPECT_LE(first_frame_timeout(slowest(), AravisTrigger::kSoftware, tries), 10s + 3s);
    EXPECT_GE(first_frame_timeout(slowest(), AravisTrigger::kSoftware, tries), 10s + 250ms);
    EXPECT_LE(first_frame_timeout(slowest(), AravisTrigger::kFreeRun, tries), 110s + 3s);
    EXPECT_GE(first_frame_timeout(slowest(), AravisTrigger::kFreeRun, tries), 110s + 250ms);
  }
  AravisCameraOptions quick;
  quick.frame_timeout_ms = 100;
  EXPECT_EQ(first_frame_timeout(quick, AravisTrigger::kSoftware, 2), 110ms);
}

TEST(AravisCamera, TellsHowLongItsOpeningMayTake) {
  AravisCameraOptions options = slowest();
  EXPECT_LE(AravisCamera(options).open_time_max(), 140s);
  options.trigger = AravisTrigger::kFreeRun;
  std::chrono::nanoseconds frames{0};
  for (int tries = 0; tries < kFirstFrameTries; ++tries)
    frames += 2 * first_frame_timeout(options, AravisTrigger::kFreeRun, tries);
  EXPECT_GE(AravisCamera(options).open_time_max(), frames + 30s);
}

TEST(NextFrameAgeMax, IsOfAFewPeriods) {
  AravisCameraOptions options;
  options.exposure_us = 1000.0;
  options.rate_hz = 500.0;
  EXPECT_LE(next_frame_age_max(options), 200ms);
  options.rate_hz = 2.0;
  EXPECT_GE(next_frame_age_max(options), 1s);
  EXPECT_LE(next_frame_age_max(options), 3s);
  options.rate_hz = 0.0;
  EXPECT_LE(next_frame_age_max(options), 1s);
}

}  // namespace
}  // namespace slsd
