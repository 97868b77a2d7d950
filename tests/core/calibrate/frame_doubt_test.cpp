// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/doubt/frame_doubt.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;

RegionCounts counted(std::uint32_t off_line, std::uint32_t out_of_range, std::uint32_t too_small = 0) {
  RegionCounts regions{};
  regions[static_cast<std::size_t>(RegionStatus::kOffEpipolarLine)] = off_line;
  regions[static_cast<std::size_t>(RegionStatus::kOutOfDepthRange)] = out_of_range;
  regions[static_cast<std::size_t>(RegionStatus::kTooSmall)] = too_small;
  return regions;
}

TEST(DoubtByCounts, BlamesWhatMostSymbolsAre) {
  EXPECT_THAT(doubt_by_counts(counted(30, 31)), HasSubstr("31 symbols lie outside the working range"));
  EXPECT_THAT(doubt_by_counts(counted(31, 31)), HasSubstr("31 symbols lie off their epipolar lines"));
}

TEST(DoubtByCounts, BlamesTheLightIfFewSymbolsWereDecoded) {
  constexpr auto kFew = static_cast<std::uint32_t>(kSymbolsForDoubt) - 1;
  EXPECT_THAT(doubt_by_counts(counted(kFew, 0, 5)), HasSubstr("among 28 bright regions: check light and focus"));
  EXPECT_THAT(doubt_by_counts(counted(0, kFew, 5)), HasSubstr("among 28 bright regions"));
  EXPECT_THAT(doubt_by_counts(counted(kFew + 1, 0)), HasSubstr("calibrate again"));
  EXPECT_THAT(doubt_by_counts(counted(0, kFew + 1)), HasSubstr("depth_min_mm"));
}

}  // namespace
}  // namespace slsd
