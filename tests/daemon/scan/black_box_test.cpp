// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/black_box.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::Each;
using ::testing::SizeIs;

constexpr std::size_t kFrameBytes = 100 * 100;

class BlackBoxTest : public ::testing::Test {
 protected:
  [[nodiscard]] FrameSet set_of(std::uint8_t grey) {
    image_ = Grey8(100, 100, grey);
    FrameSet set;
    set.frames.emplace_back(image_.view(), 1, MonotonicTime(), MonotonicTime());
    return set;
  }
  void keep(int number) {
    box_.keep_frames(std::to_string(number), set_of(static_cast<std::uint8_t>(number)), setup_, ScanRequest{});
    Result<ScanResult> result = ScanResult();
    box_.keep_outcome(std::to_string(number), setup_, result);
  }
  void fail_scan(const std::string& id, ErrorCode code) {
    Result<ScanResult> result = fail(code, "as told", "camera left");
    box_.keep_outcome(id, setup_, result);
  }

  Grey8 image_;
  SharedSetup setup_ = std::make_shared<ScanSetup>(ScanSetup{*make_pattern({}), {}, {}, {"left"}, {}});
  BlackBox box_{4 * (kFrameBytes + 2048)};
};

TEST_F(BlackBoxTest, KeepsTheNewestWithinItsBytes) {
  for (int number = 1; number <= 9; ++number) {
    keep(number);
    EXPECT_LE(box_.bytes(), box_.bytes_max());
  }
  const auto scans = box_.scans();
  ASSERT_EQ(scans.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(scans[i].id, std::to_string(6 + i));
    ASSERT_THAT(*scans[i].frames, SizeIs(1));
    EXPECT_EQ(scans[i].frames->front().camera, "left");
    EXPECT_THAT(scans[i].frames->front().bytes, Each(static_cast<char>(6 + i)));
  }
}

// A replay has no colours, so it needs no texture camera.
TEST_F(BlackBoxTest, KeepsNoFramesOfTextureCameras) {
  setup_->camera_names = {"left", "texture"};
  setup_->texture_cameras = 1;
  FrameSet set = set_of(7);
  for (auto* frames : {&set.white, &set.dark})
    for (int camera = 0; camera < 2; ++camera) frames->emplace_back(image_.view(), 1, MonotonicTime(), MonotonicTime());
  box_.keep_frames("1", set, setup_, ScanRequest{});
  const auto scans = box_.scans();
  ASSERT_THAT(*scans.front().frames, SizeIs(3));
  for (const FrameImage& frame : *scans.front().frames) EXPECT_EQ(frame.camera, "left");
  EXPECT_EQ(scans.front().settings->camera_names, std::vector<std::string>{"left"});
}

// The memory of a scan that goes is that of the next: but not while a bundle is made of it.
TEST_F(BlackBoxTest, LeavesAloneWhatABundleIsMadeOf) {
  keep(1);
  const auto taken = box_.scans();
  for (int number = 2; number <= 9; ++number) keep(number);
  EXPECT_THAT(taken.front().frames->front().bytes, Each('\1'));
}

TEST_F(BlackBoxTest, AFrameThatIsTooLargeIsNotKept) {
  BlackBox small(kFrameBytes);
  small.keep_frames("1", set_of(1), setup_, ScanRequest{});
  ASSERT_THAT(small.scans(), SizeIs(1));
  EXPECT_TRUE(small.scans().front().too_large);
  EXPECT_EQ(small.scans().front().frames, nullptr);
}

// A camera that is unplugged fails on and on: the scans before stay.
TEST_F(BlackBoxTest, CountsFailuresThatAreTheSame) {
  keep(1);
  for (int i = 0; i < 1000; ++i) fail_scan("2", ErrorCode::kDisconnected);
  for (int i = 0; i < 1000; ++i) fail_scan(std::to_string(100 + i), ErrorCode::kFrameDropped);
  const auto scans = box_.scans();
  ASSERT_EQ(scans.size(), 3U);
  EXPECT_EQ(scans[0].id, "1");
  EXPECT_EQ(scans[2].times, 1000U);
  EXPECT_EQ(scans[2].outcome->error().code, ErrorCode::kFrameDropped);
}

// A deadline may pass while its frames are decoded: what is told first comes to the same scan.
TEST_F(BlackBoxTest, TakesOutcomeAndFramesInEitherOrder) {
  fail_scan("7", ErrorCode::kTimeout);
  box_.keep_frames("7", set_of(7), setup_, ScanRequest{});
  const auto scans = box_.scans();
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].outcome->error().code, ErrorCode::kTimeout);
  EXPECT_THAT(*scans[0].frames, SizeIs(1));
}

TEST_F(BlackBoxTest, GivesTheResultBackAsItWas) {
  Result<ScanResult> result = ScanResult();
  result->picture_png = "picture";
  result->frames.resize(2);
  result->cloud.points.resize(3);
  box_.keep_outcome("1", setup_, result);
  EXPECT_EQ(result->picture_png, "picture");
  EXPECT_THAT(result->frames, SizeIs(2));
  const auto scans = box_.scans();
  EXPECT_THAT(scans[0].outcome->value().cloud.points, SizeIs(3));
  EXPECT_EQ(scans[0].outcome->value().picture_png, "");
}

}  // namespace
}  // namespace slsd
