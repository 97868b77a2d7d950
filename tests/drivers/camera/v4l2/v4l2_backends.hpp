// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <future>
#include <memory>

#include <gtest/gtest.h>

#include "drivers/camera/v4l2/v4l2_camera.hpp"
#include "tests/doubles/v4l2/v4l2_double.hpp"

namespace slsd::test {

/// A V4l2Camera with the double that it is on; null where this machine or user cannot mount FUSE.
[[nodiscard]] std::unique_ptr<Camera> v4l2_camera_on_double(std::uint32_t fourcc);

/// The device that the environment variable SLSD_TEST_V4L2 names; null where it names none.
[[nodiscard]] std::unique_ptr<Camera> real_v4l2_camera();

/// Tests on a double, skipped where there can be none.
class V4l2Test : public ::testing::Test {
 protected:
  /// Makes the double and a camera on it. Where it returns false the test is over.
  [[nodiscard]] bool make(DoubleOptions options, V4l2CameraOptions camera = {});

  /// Captures on another thread, and returns once it waits for its frame.
  [[nodiscard]] std::future<Result<Frame>> begin_capture(std::chrono::nanoseconds time = std::chrono::minutes(1));
  /// One frame of a triggered double.
  [[nodiscard]] Result<Frame> capture_one();
  /// One frame, whatever the double does.
  [[nodiscard]] Result<Frame> capture();

  std::unique_ptr<V4l2Double> double_;
  std::unique_ptr<V4l2Camera> camera_;
};

/// Quick, so that the tests are.
[[nodiscard]] DoubleOptions quick_double();
[[nodiscard]] DoubleOptions triggered_double();

}  // namespace slsd::test
