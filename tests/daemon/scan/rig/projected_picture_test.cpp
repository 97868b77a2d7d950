// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/projected_picture.hpp"

#include <gmock/gmock.h>

#include "drivers/files/encode_png.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

ScanSetup setup() {
  const Pattern pattern = *make_pattern({});
  return {pattern, draw_pattern(pattern), paper_rig(), {"camera"}, {}};
}

MonotonicTime soon() {
  return std::chrono::steady_clock::now() + std::chrono::seconds(60);
}

TEST(DrawProjected, DrawsEach) {
  const ScanSetup setup = slsd::setup();
  const auto draw = [&](Picture picture) { return *draw_projected(picture, {}, setup, soon()); };
  EXPECT_EQ(draw(Picture::kPattern), std::nullopt);
  EXPECT_EQ(draw(Picture::kBlack), Grey8(1280, 800, 0));
  EXPECT_EQ(draw(Picture::kWhite), Grey8(1280, 800, 255));
  EXPECT_EQ(draw(Picture::kFocus)->at(0, 0), 255);
  EXPECT_EQ(draw(Picture::kGrid)->at(0, 0), 255);
}

TEST(DrawProjected, TakesAnImageOfTheProjectorsSize) {
  const ScanSetup setup = slsd::setup();
  const auto draw = [&](const std::string& png) { return draw_projected(Picture::kImage, png, setup, soon()); };
  EXPECT_EQ(*draw(*encode_png(Grey8(1280, 800, 42))), Grey8(1280, 800, 42));
  const auto other = draw(*encode_png(Grey8(1280, 720)));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(other.error().message, HasSubstr("1280x720 pixels, the projector 1280x800"));
  EXPECT_EQ(draw(*encode_png(Grey16(1280, 800))).error().code, ErrorCode::kMismatch);
  EXPECT_FALSE(draw("no image"));
}

TEST(DrawProjected, TakesNoLongerThanItMay) {
  const auto late = draw_projected(Picture::kImage, *encode_png(Grey8(1280, 800)), setup(), MonotonicTime());
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::kTimeout);
}

TEST(DrawProjected, NeedsACalibrationForTheGrid) {
  ScanSetup setup = slsd::setup();
  setup.calibration.reset();
  EXPECT_EQ(draw_projected(Picture::kGrid, {}, setup, soon()).error().code, ErrorCode::kNotFound);
}

TEST(DrawIdle, FollowsTheConfiguration) {
  EXPECT_EQ(draw_idle({}), std::nullopt);
  ProjectorOptions options;
  options.idle = Picture::kWhite;
  EXPECT_EQ(draw_idle(options), Grey8(1280, 800, 255));
  options.idle = Picture::kBlack;
  EXPECT_EQ(draw_idle(options), Grey8(1280, 800, 0));
}

}  // namespace
}  // namespace slsd
