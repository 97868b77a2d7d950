// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/file_camera.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>

#include <gtest/gtest.h>

#include "tests/drivers/allocations.hpp"
#include "tests/drivers/camera/file_camera_test.hpp"
#include "tests/drivers/jpeg_bytes.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using test::far_away;
using test::FileCameraTest;
using test::ramp8;
using test::resident_mib;
using test::samples_of;

TEST_F(FileCameraTest, ReplaysAFolderInTheOrderOfNamesAndBeginsAnew) {
  folder_.write("b.pgm", test::pnm_bytes(samples_of(ramp8(12, 8, 20))));
  folder_.write("a.PNG", test::png_bytes(samples_of(ramp8(12, 8, 10))));
  folder_.write("B.tiff", test::tiff_bytes(samples_of(ramp8(12, 8, 0)), false));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  for (const int expected : {0, 1, 2, 0, 1, 2, 0}) EXPECT_EQ(next(camera), expected);
}

TEST_F(FileCameraTest, ReplaysJpegAmongOthers) {
  const std::string jpeg = test::jpeg_bytes(Grey8(12, 8, 45));
  test::record(folder_, 1);
  folder_.write("a.jpg", jpeg);
  folder_.write("b.JPEG", jpeg);
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 4);
  EXPECT_EQ(next(camera), 4);
  EXPECT_EQ(next(camera), 0);
}

TEST_F(FileCameraTest, PassesOverWhatIsNoImage) {
  test::record(folder_, 1);
  folder_.write("a.txt", "notes");
  folder_.write(".hidden.png", "part of a file");
  folder_.write("below.png/frame.png", "");
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  EXPECT_EQ(next(camera), 0);
}

TEST_F(FileCameraTest, ShowsAnImageAsItIsNow) {
  FileCameraOptions one = options();
  one.path = folder_.write("now.pgm", test::pnm_bytes(samples_of(ramp8(12, 8, 10))));
  FileCamera camera(one);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 1);
  folder_.write("next.pgm", test::pnm_bytes(samples_of(ramp8(12, 8, 20))));
  std::filesystem::rename(folder_.path() / "next.pgm", one.path);
  EXPECT_EQ(next(camera), 2);
}

TEST_F(FileCameraTest, TurnsMosaicsIntoGrey) {
  folder_.write("a.png", test::png_bytes(samples_of(ramp8(12, 8))));
  FileCameraOptions bayer = options();
  bayer.bayer = BayerPattern::kGrbg;
  FileCamera camera(bayer);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture(far_away());
  EXPECT_EQ(std::get<ImageView<std::uint8_t>>(frame->image()).at(5, 4), grey_from_mosaic(ramp8(12, 8)).at(5, 4));
}

TEST_F(FileCameraTest, AllocatesNothingOnceItsImagesAreDecoded) {
  test::record(folder_, 10);
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  for (int i = 0; i < 10; ++i) EXPECT_EQ(next(camera), i);
  const std::uint64_t before = test::allocations();
  for (int i = 0; i < 10000; ++i) ASSERT_TRUE(camera.capture(MonotonicTime::max()).has_value());
  EXPECT_EQ(test::allocations(), before);
}

TEST_F(FileCameraTest, KeepsItsMemoryFlatWhereTheCacheIsTooSmall) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers keep freed memory";
#endif
  folder_.write("a.png", test::png_bytes(samples_of(ramp8(320, 240))));
  folder_.write("b.tif", test::tiff_bytes(samples_of(ramp8(320, 240)), false));
  FileCameraOptions uncached = options();
  uncached.cache_bytes = 100;
  FileCamera camera(uncached);
  ASSERT_TRUE(camera.open());
  for (int i = 0; i < 100; ++i) EXPECT_EQ(next(camera), 0);
  const double before_mib = resident_mib();
  for (int i = 0; i < 2000; ++i) EXPECT_EQ(next(camera), 0);
  EXPECT_LT(resident_mib() - before_mib, 4.0);  // one leaked image in a hundred would be 1.5
}

TEST(FileCameraOptionsTest, NamesTheKeyThatIsOutOfRange) {
  const auto where = [](auto change) {
    FileCameraOptions options{.path = "frames"};
    change(options);
    const auto valid = options.validate();
    return valid ? "valid" : valid.error().where;
  };
  EXPECT_EQ(where([](auto&) {}), "valid");
  EXPECT_EQ(where([](auto& o) { o.name = ""; }), "name");
  EXPECT_EQ(where([](auto& o) { o.path = ""; }), "path");
  for (const double rate_hz : {-1.0, 1001.0, 1e-9, std::nan("")})
    EXPECT_EQ(where([&](auto& o) { o.rate_hz = rate_hz; }), "rate_hz");
  EXPECT_EQ(where([](auto& o) { o.size_px = {0, 5}; }), "size_px");
  EXPECT_EQ(where([](auto& o) { o.frames_held_max = 1; }), "frames_held_max");
}

}  // namespace
}  // namespace slsd
