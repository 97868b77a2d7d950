// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <gtest/gtest.h>

#include "drivers/camera/file_camera.hpp"
#include "tests/drivers/camera/recording.hpp"
#include "tests/drivers/temporary_folder.hpp"

namespace slsd::test {

/// Tests on a folder of images.
class FileCameraTest : public ::testing::Test {
 protected:
  FileCameraOptions options() { return {.name = "left", .path = folder_.path()}; }

  /// The number of the next frame; -1 if it failed.
  static int next(Camera& camera) {
    const auto frame = camera.capture(far_away());
    EXPECT_TRUE(frame) << to_string(frame.error());
    return frame ? number_of(*frame) : -1;
  }

  static ErrorCode next_error(Camera& camera) {
    const auto frame = camera.capture(far_away());
    EXPECT_FALSE(frame);
    return frame ? ErrorCode{} : frame.error().code;
  }

  TemporaryFolder folder_;
};

}  // namespace slsd::test
