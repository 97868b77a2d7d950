// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// When the images come: at a rate, until a deadline or cancel(), once or again and again.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "tests/drivers/camera/file_camera_test.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::far_away;
using test::FileCameraTest;

TEST_F(FileCameraTest, EndsAfterTheLastImageWithoutLoop) {
  test::record(folder_, 2);
  FileCameraOptions once = options();
  once.loop = false;
  FileCamera camera(once);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  EXPECT_EQ(next(camera), 1);
  EXPECT_EQ(next_error(camera), ErrorCode::kNotFound);
  EXPECT_EQ(next_error(camera), ErrorCode::kNotFound);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
}

TEST_F(FileCameraTest, RunsAtItsRate) {
  test::record(folder_, 3);
  FileCameraOptions paced = options();
  paced.rate_hz = 200.0;
  FileCamera camera(paced);
  ASSERT_TRUE(camera.open());
  const MonotonicTime first = camera.capture(far_away())->exposure_start();
  for (int i = 0; i < 5; ++i) {
    const MonotonicTime trigger = steady_clock::now();
    const auto frame = camera.capture(far_away());
    ASSERT_TRUE(frame);
    EXPECT_GE(frame->exposure_start(), trigger);
    EXPECT_EQ((frame->exposure_start() - first) % 5ms, 0ns);
  }
}

TEST_F(FileCameraTest, IsLateWhereNoExposureBeginsBeforeTheDeadline) {
  test::record(folder_, 1);
  FileCameraOptions slow = options();
  slow.rate_hz = 0.01;
  FileCamera camera(slow);
  ASSERT_TRUE(camera.open());
  const MonotonicTime deadline = steady_clock::now() + 5ms;
  const auto frame = camera.capture(deadline);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kFrameLate);
  EXPECT_GE(steady_clock::now(), deadline);
}

TEST_F(FileCameraTest, EndsItsWaitWhenCancelled) {
  test::record(folder_, 1);
  FileCameraOptions slow = options();
  slow.rate_hz = 0.01;
  FileCamera camera(slow);
  ASSERT_TRUE(camera.open());
  std::jthread canceller([&] {
    std::this_thread::sleep_for(2ms);
    camera.cancel();
  });
  EXPECT_EQ(next_error(camera), ErrorCode::kCancelled);
}

}  // namespace
}  // namespace slsd
