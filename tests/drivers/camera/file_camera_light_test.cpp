// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// The folders of frames in white light and in the dark, beside those under the pattern.
#include <string>

#include <gmock/gmock.h>

#include "tests/drivers/camera/file_camera_test.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using test::far_away;
using test::FileCameraTest;
using test::ramp8;
using test::samples_of;
using ::testing::HasSubstr;

class FileCameraInLightTest : public FileCameraTest {
 protected:
  void put(const std::string& name, int number) {
    folder_.write(name, test::pnm_bytes(samples_of(ramp8(12, 8, 10 * number))));
  }
  static int next_in(Camera& camera, Picture light) {
    camera.expect(light);
    return next(camera);
  }
};

TEST_F(FileCameraInLightTest, ReplaysWhatBelongsToTheFrameOfThePattern) {
  for (const int i : {0, 1, 2}) put("0" + std::to_string(i) + ".pgm", i);
  for (const int i : {3, 4, 5}) put("white/0" + std::to_string(i) + ".pgm", i);
  put("dark/0.pgm", 6);
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  for (const int frame : {0, 1, 2, 0, 1}) {
    EXPECT_EQ(next_in(camera, Picture::kPattern), frame);
    EXPECT_EQ(next_in(camera, Picture::kBlack), 6);
    if (frame == 1) continue;
    EXPECT_EQ(next_in(camera, Picture::kWhite), frame + 3);
    EXPECT_EQ(next_in(camera, Picture::kWhite), frame + 3);
  }
}

TEST_F(FileCameraInLightTest, GivesColoursWithoutThePatternAlone) {
  put("0.pgm", 0);
  put("dark/0.pgm", 1);
  const ColourImage white(12, 8, Rgb{1, 2, 3});
  folder_.write("white/0.ppm", test::pnm_bytes(samples_of(white)));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  for (const auto& [light, expected] :
       {std::pair(Picture::kPattern, ColourFrame()), std::pair(Picture::kWhite, ColourFrame(12, 8, {1, 2, 3})),
        std::pair(Picture::kBlack, ColourFrame())}) {
    camera.expect(light);
    const auto frame = camera.capture(far_away());
    ASSERT_TRUE(frame) << to_string(frame.error());
    EXPECT_EQ(frame->colours(), expected);
  }
}

// Two exposures of each picture; a scan that ended after the first does not put them out of step.
TEST_F(FileCameraInLightTest, ReplaysTheExposureThatIsSet) {
  for (const int i : {0, 1, 2, 3}) put("0" + std::to_string(i) + ".pgm", i);
  for (const int i : {4, 5, 6, 7}) put("white/0" + std::to_string(i) + ".pgm", i);
  auto two = options();
  two.exposures_us = {1000, 4000};
  FileCamera camera(two);
  ASSERT_TRUE(camera.open());
  const auto next_with = [&](double exposure_us, Picture light) {
    EXPECT_TRUE(camera.set_exposure(exposure_us));
    return next_in(camera, light);
  };
  EXPECT_EQ(next_with(1000, Picture::kPattern), 0);
  EXPECT_EQ(next_with(4000, Picture::kPattern), 1);
  EXPECT_EQ(next_with(1000, Picture::kPattern), 2);
  EXPECT_EQ(next_with(1000, Picture::kPattern), 0);
  EXPECT_EQ(next_with(4000, Picture::kPattern), 1);
  EXPECT_EQ(next_with(1000, Picture::kWhite), 4);
  EXPECT_EQ(next_with(4000, Picture::kWhite), 5);
  EXPECT_EQ(next_with(1000, Picture::kPattern), 2);
  EXPECT_EQ(next_with(4000, Picture::kPattern), 3);
  EXPECT_EQ(next_with(1000, Picture::kWhite), 6);
  EXPECT_EQ(next_with(4000, Picture::kWhite), 7);
  EXPECT_EQ(camera.set_exposure(2000).error().code, ErrorCode::kUnsupported);
}

TEST_F(FileCameraInLightTest, CountsEveryFrame) {
  put("0.pgm", 0);
  put("white/0.pgm", 1);
  auto once = options();
  once.loop = false;
  FileCamera camera(once);
  ASSERT_TRUE(camera.open());
  const auto pattern = camera.capture(far_away());
  camera.expect(Picture::kWhite);
  const auto white = camera.capture(far_away());
  ASSERT_TRUE(pattern && white);
  EXPECT_EQ(white->sequence(), pattern->sequence() + 1);
  camera.expect(Picture::kPattern);
  EXPECT_EQ(next_error(camera), ErrorCode::kNotFound);
}

TEST_F(FileCameraInLightTest, TakesTheFoldersBesideOneImage) {
  put("a.pgm", 0);
  put("white/0.pgm", 1);
  auto one = options();
  one.path = folder_.path() / "a.pgm";
  FileCamera camera(one);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next_in(camera, Picture::kWhite), 1);
  EXPECT_EQ(next_in(camera, Picture::kPattern), 0);
}

TEST_F(FileCameraInLightTest, SaysWhichFolderIsMissingOrOfAnotherSize) {
  put("a.pgm", 0);
  folder_.write("white/0.pgm", test::pnm_bytes(samples_of(ramp8(10, 8, 0))));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  camera.expect(Picture::kBlack);
  const auto dark = camera.capture(far_away());
  ASSERT_FALSE(dark);
  EXPECT_EQ(dark.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(dark.error().message, HasSubstr("\"dark\""));
  camera.expect(Picture::kWhite);
  const auto white = camera.capture(far_away());
  ASSERT_FALSE(white);
  EXPECT_EQ(white.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(white.error().message, HasSubstr("folder \"white\" is 10x8"));
  EXPECT_EQ(next_in(camera, Picture::kPattern), 0);
}

}  // namespace
}  // namespace slsd
