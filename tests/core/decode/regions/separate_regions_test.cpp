// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/separate_regions.hpp"

#include <gmock/gmock.h>

#include "tests/core/decode/images.hpp"

namespace slsd {
namespace {

constexpr SeparateOptions kOptions{.tile_px = 6};
constexpr float kContrastMin = 8;
const auto kEvery = [](const Region&) { return true; };
const auto kNone = [](const Region&) { return false; };

// Two symbols with light in the gap between them, and one alone.
Grey8 two_run_together() {
  Grey8 frame(30, 20, 10);
  const auto fill = [&](int left, int top, int right, int bottom, std::uint8_t value) {
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) frame.at(x, y) = value;
    }
  };
  fill(3, 4, 8, 9, 200);
  fill(9, 4, 10, 9, 90);
  fill(11, 4, 16, 9, 200);
  fill(22, 12, 27, 17, 200);
  return frame;
}

Regions regions_of(const Grey8& frame) {
  Grey8 mask(frame.width(), frame.height());
  for (std::size_t i = 0; i < mask.size(); ++i) mask.data()[i] = frame.data()[i] > 50 ? 255 : 0;
  Regions found;
  RegionFinder().find(Mask(mask.view()), found);
  return found;
}

void expect_split(const Regions& regions) {
  ASSERT_THAT(regions.regions, testing::SizeIs(3));
  EXPECT_EQ(regions.regions[0].left, 22);
  for (const auto& [index, left] : {std::pair(1, 3), std::pair(2, 11)}) {
    const Region& part = regions.regions[index];
    EXPECT_EQ(part.left, left);
    EXPECT_EQ(part.right, left + 5);
    EXPECT_EQ(part.top, 4);
    EXPECT_EQ(part.bottom, 9);
    EXPECT_EQ(part.area_px, 36);
    ASSERT_EQ(regions.runs_of(part).size(), 6U);
    EXPECT_EQ(regions.runs_of(part)[0].left, left);
    EXPECT_EQ(regions.runs_of(part)[5].row, 9);
  }
}

TEST(SplitRegions, TakesApartWhatRanTogether) {
  const Grey8 frame = two_run_together();
  Regions regions = regions_of(frame);
  ASSERT_THAT(regions.regions, testing::SizeIs(2));
  RegionSeparator(kOptions).separate_all(frame.view(), kContrastMin, regions, kEvery);
  expect_split(regions);
}

TEST(SplitRegions, TakesApartSixteenBitsAlike) {
  const Grey8 frame = two_run_together();
  Regions regions = regions_of(frame);
  RegionSeparator(kOptions).separate_all(sixteen_bits(frame).view(), kContrastMin, regions, kEvery);
  expect_split(regions);
}

TEST(SplitRegions, LeavesWhatIsNotMerged) {
  const Grey8 frame = two_run_together();
  Regions regions = regions_of(frame);
  RegionSeparator(kOptions).separate_all(frame.view(), kContrastMin, regions, kNone);
  ASSERT_THAT(regions.regions, testing::SizeIs(2));
  EXPECT_EQ(regions.regions[0].area_px, 84);
}

TEST(SplitRegions, LeavesWholeWhatTheLevelDoesNotSplit) {
  const Grey8 frame = two_run_together();
  Regions regions = regions_of(frame);
  regions.regions.erase(regions.regions.begin() + 1);
  Grey8 even = frame;
  for (std::size_t i = 0; i < even.size(); ++i) even.data()[i] = even.data()[i] > 50 ? 200 : 10;
  RegionSeparator(kOptions).separate_all(even.view(), kContrastMin, regions, kEvery);
  ASSERT_THAT(regions.regions, testing::SizeIs(1));
  EXPECT_EQ(regions.regions[0].area_px, 84);
}

}  // namespace
}  // namespace slsd
