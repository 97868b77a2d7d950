// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/file_camera.hpp"

#include <unistd.h>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "tests/drivers/allocations.hpp"
#include "tests/drivers/camera/recording.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::far_away;
using test::number_of;
using test::ramp16;
using test::ramp8;
using test::samples_of;
using ::testing::HasSubstr;

class FileCameraTest : public ::testing::Test {
 protected:
  FileCameraOptions options() { return {.name = "left", .path = folder_.path()}; }

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

  test::TemporaryFolder folder_;
};

TEST_F(FileCameraTest, ReplaysAFolderInTheOrderOfNamesAndBeginsAnew) {
  folder_.write("b.pgm", test::pnm_bytes(samples_of(ramp8(12, 8, 20))));
  folder_.write("a.PNG", test::png_bytes(samples_of(ramp8(12, 8, 10))));
  folder_.write("B.tiff", test::tiff_bytes(samples_of(ramp8(12, 8, 0)), false));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  for (const int expected : {0, 1, 2, 0, 1, 2, 0}) EXPECT_EQ(next(camera), expected);
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

TEST_F(FileCameraTest, RefusesAnotherDepthThanTheFirst) {
  test::record(folder_, 1);
  folder_.write("frame-1.pgm", test::pnm_bytes(samples_of(ramp16(12, 8))));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next(camera), 0);
  EXPECT_EQ(next_error(camera), ErrorCode::kMismatch);
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

double resident_mib() {
  long total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return static_cast<double>(resident * ::sysconf(_SC_PAGESIZE)) / (1 << 20);
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

class FileCameraInLightTest : public FileCameraTest {
 protected:
  void put(const std::string& name, int number) {
    folder_.write(name, test::pnm_bytes(samples_of(ramp8(12, 8, 10 * number))));
  }
  static int next_in(Camera& camera, FrameLight light) {
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
    EXPECT_EQ(next_in(camera, FrameLight::kPattern), frame);
    EXPECT_EQ(next_in(camera, FrameLight::kDark), 6);
    if (frame == 1) continue;
    EXPECT_EQ(next_in(camera, FrameLight::kWhite), frame + 3);
    EXPECT_EQ(next_in(camera, FrameLight::kWhite), frame + 3);
  }
}

TEST_F(FileCameraInLightTest, CountsEveryFrame) {
  put("0.pgm", 0);
  put("white/0.pgm", 1);
  auto once = options();
  once.loop = false;
  FileCamera camera(once);
  ASSERT_TRUE(camera.open());
  const auto pattern = camera.capture(far_away());
  camera.expect(FrameLight::kWhite);
  const auto white = camera.capture(far_away());
  ASSERT_TRUE(pattern && white);
  EXPECT_EQ(white->sequence(), pattern->sequence() + 1);
  camera.expect(FrameLight::kPattern);
  EXPECT_EQ(next_error(camera), ErrorCode::kNotFound);
}

TEST_F(FileCameraInLightTest, TakesTheFoldersBesideOneImage) {
  put("a.pgm", 0);
  put("white/0.pgm", 1);
  auto one = options();
  one.path = folder_.path() / "a.pgm";
  FileCamera camera(one);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(next_in(camera, FrameLight::kWhite), 1);
  EXPECT_EQ(next_in(camera, FrameLight::kPattern), 0);
}

TEST_F(FileCameraInLightTest, SaysWhichFolderIsMissingOrOfAnotherSize) {
  put("a.pgm", 0);
  folder_.write("white/0.pgm", test::pnm_bytes(samples_of(ramp8(10, 8, 0))));
  FileCamera camera(options());
  ASSERT_TRUE(camera.open());
  camera.expect(FrameLight::kDark);
  const auto dark = camera.capture(far_away());
  ASSERT_FALSE(dark);
  EXPECT_EQ(dark.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(dark.error().message, HasSubstr("\"dark\""));
  camera.expect(FrameLight::kWhite);
  const auto white = camera.capture(far_away());
  ASSERT_FALSE(white);
  EXPECT_EQ(white.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(white.error().message, HasSubstr("folder \"white\" is 10x8"));
  EXPECT_EQ(next_in(camera, FrameLight::kPattern), 0);
}

}  // namespace
}  // namespace slsd
