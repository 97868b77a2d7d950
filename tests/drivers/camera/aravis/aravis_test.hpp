// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "drivers/camera/aravis/aravis_camera.hpp"
#include "tests/drivers/camera/aravis/gige_backend.hpp"
#include "tests/drivers/camera/recording.hpp"

namespace slsd::test {

/// Tests on a double.
class AravisTest : public ::testing::Test {
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
  static bool next_is_newest(Camera& camera, const GigeCamera& device) {
    const auto counter = next(camera);
    return counter && *counter == device.frames_exposed() - 1;
  }

  static ErrorCode error_of(Camera& camera, MonotonicTime deadline = far_away()) {
    const auto frame = camera.capture(deadline);
    EXPECT_FALSE(frame);
    return frame ? ErrorCode{} : frame.error().code;
  }

  GigeCamera device_;
};

}  // namespace slsd::test
