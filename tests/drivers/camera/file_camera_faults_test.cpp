// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// What the camera makes of images and folders that are not as they should be.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "tests/drivers/camera/file_camera_test.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using test::far_away;
using test::FileCameraTest;
using test::ramp16;
using test::ramp8;
using test::samples_of;
using ::testing::HasSubstr;

TEST_F(FileCameraTest, LosesOnlyTheFrameOfABadImage) {
  test::record(folder_, 4);
  folder_.write("frame-1.pgm", "P5 12 8 255\nshort");
  folder_.write("frame-2.pgm", test::pnm_bytes(samples_of(ramp8(12, 9))));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  EXPECT_EQ(next_error(camera), ErrorCode::kMalformed);
  const auto other_size = camera.capture(far_away());
  EXPECT_EQ(other_size.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(other_size.error().message, HasSubstr("12x9"));
  EXPECT_EQ(camera.capture(far_away())->sequence(), 3u);
}

TEST_F(FileCameraTest, PassesOverNoImageWhileItIsBusy) {
  test::record(folder_, 5);
  FileCameraOptions few = options();
  few.frames_held_max = 2;
  FileCamera camera(few);
  ASSERT_TRUE(camera.open());
  {
    const auto first = camera.capture(far_away());
    const auto second = camera.capture(far_away());
    ASSERT_TRUE(first && second);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(next_error(camera), ErrorCode::kBusy);
  }
  const auto third = camera.capture(far_away());
  ASSERT_TRUE(third);
  EXPECT_EQ(test::number_of(*third), 2);
  EXPECT_EQ(third->sequence(), 2u);
}

TEST_F(FileCameraTest, RefusesAnotherDepthThanTheFirst) {
  test::record(folder_, 1);
  folder_.write("frame-1.pgm", test::pnm_bytes(samples_of(ramp16(12, 8))));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  EXPECT_EQ(next_error(camera), ErrorCode::kMismatch);
}

TEST_F(FileCameraTest, OpensAgainWhenOtherImagesReplaceItsOwn) {
  test::record(folder_, 3);
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  const auto write = [this](const std::string& name) {
    folder_.write(name, test::pnm_bytes(samples_of(ramp8(24, 16))));
  };
  write("frame-1.pgm");
  EXPECT_EQ(next_error(camera), ErrorCode::kMismatch);  // the first is as it was
  EXPECT_EQ(next(camera), 2);
  write("frame-2.pgm"), write("frame-0.pgm");
  const auto replaced = camera.capture(far_away());
  EXPECT_EQ(replaced.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(replaced.error().message, HasSubstr("replaced those of 12x8 with 8 bits"));
  EXPECT_EQ(next_error(camera), ErrorCode::kDisconnected);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(camera.description().width_px, 24);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(format_of(camera.capture(far_away())->image()).width_px, 24);
}

TEST_F(FileCameraTest, OpensAgainWhenAnotherImageReplacesTheOnlyOne) {
  folder_.write("only.pgm", test::pnm_bytes(samples_of(ramp8(12, 8))));
  FileCameraOptions one = options();
  one.path = folder_.path() / "only.pgm";
  FileCamera camera(one);
  ASSERT_TRUE(camera.open());
  folder_.write("only.pgm", test::pnm_bytes(samples_of(ramp16(12, 8))));
  EXPECT_EQ(next_error(camera), ErrorCode::kDisconnected);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(format_of(camera.capture(far_away())->image()).bytes_per_pixel, 2);
}

TEST_F(FileCameraTest, RefusesAnotherSizeThanExpected) {
  test::record(folder_, 1);
  FileCameraOptions expecting = options();
  expecting.size_px = {12, 8};
  EXPECT_TRUE(FileCamera(expecting).open());
  expecting.size_px = {1600, 1200};
  const auto refused = FileCamera(expecting).open();
  EXPECT_EQ(refused.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(refused.error().message, HasSubstr("12x8"));
  EXPECT_THAT(refused.error().message, HasSubstr("1600x1200"));
}

TEST_F(FileCameraTest, NamesWhatIsWrongWithItsPath) {
  EXPECT_EQ(FileCamera(options()).open().error().code, ErrorCode::kNotFound);
  FileCameraOptions nowhere = options();
  nowhere.path = folder_.path() / "nowhere";
  const auto refused = FileCamera(nowhere).open();
  EXPECT_EQ(refused.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(refused.error().where, nowhere.path.string());
  folder_.write("a.png", "");
  EXPECT_EQ(FileCamera(options()).open().error().code, ErrorCode::kMalformed);
}

TEST_F(FileCameraTest, ListsItsFolderAgainWhenAnImageGoes) {
  test::record(folder_, 3);
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  std::filesystem::remove(folder_.path() / "frame-1.pgm");
  const auto gone = camera.capture(far_away());
  EXPECT_EQ(gone.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(gone.error().where, HasSubstr("frame-1.pgm"));
  ASSERT_TRUE(camera.open());
  for (const int expected : {0, 2, 0}) EXPECT_EQ(next(camera), expected);
  for (const char* name : {"frame-0.pgm", "frame-2.pgm"}) std::filesystem::remove(folder_.path() / name);
  EXPECT_EQ(next_error(camera), ErrorCode::kDisconnected);
  EXPECT_EQ(camera.open().error().code, ErrorCode::kNotFound);
  test::record(folder_, 1);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
}

TEST_F(FileCameraTest, IsDisconnectedWhenItsFolderGoes) {
  const std::filesystem::path path = folder_.path() / "frames";
  std::filesystem::create_directory(path);
  folder_.write("frames/a.pgm", test::pnm_bytes(samples_of(ramp8(12, 8))));
  FileCameraOptions below = options();
  below.path = path;
  FileCamera camera(below);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  std::filesystem::rename(path, folder_.path() / "elsewhere");
  EXPECT_EQ(next_error(camera), ErrorCode::kDisconnected);
  std::filesystem::rename(folder_.path() / "elsewhere", path);
  EXPECT_EQ(next_error(camera), ErrorCode::kDisconnected);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
}

TEST_F(FileCameraTest, IsDisconnectedWhenAFileTakesThePlaceOfItsFolder) {
  const std::filesystem::path path = folder_.path() / "frames.pgm";
  std::filesystem::create_directory(path);
  const std::string image = test::pnm_bytes(samples_of(ramp8(12, 8)));
  folder_.write("frames.pgm/a.pgm", image);
  FileCameraOptions below = options();
  below.path = path;
  FileCamera camera(below);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  std::filesystem::remove_all(path);
  folder_.write("frames.pgm", image);
  EXPECT_EQ(next_error(camera), ErrorCode::kDisconnected);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
}

}  // namespace
}  // namespace slsd
