// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/find_regions.hpp"

#include <map>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/core/decode/images.hpp"

namespace slsd {
namespace {

using Labels = Image<int>;  // 0 where dark, regions from 1 on

Regions find(const Grey8& mask) {
  Regions found;
  RegionFinder().find(Mask(mask.view()), found);
  return found;
}

Labels paint(const Regions& found, int width, int height) {
  Labels labels(width, height);
  for (std::size_t i = 0; i < found.regions.size(); ++i) {
    for (const Run& run : found.runs_of(found.regions[i])) {
      for (int x = run.left; x < run.right; ++x) labels.at(x, run.row) = static_cast<int>(i) + 1;
    }
  }
  return labels;
}

Labels flood_fill(const Grey8& mask) {
  Labels labels(mask.width(), mask.height());
  int count = 0;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (mask.at(x, y) == 0 || labels.at(x, y) != 0) continue;
      std::vector<std::pair<int, int>> open{{x, y}};
      labels.at(x, y) = ++count;
      while (!open.empty()) {
        const auto [px, py] = open.back();
        open.pop_back();
        for (int ny = py - 1; ny <= py + 1; ++ny) {
          for (int nx = px - 1; nx <= px + 1; ++nx) {
            if (!mask.view().contains(nx, ny) || mask.at(nx, ny) == 0 || labels.at(nx, ny) != 0) continue;
            labels.at(nx, ny) = count;
            open.emplace_back(nx, ny);
          }
        }
      }
    }
  }
  return labels;
}

Grey8 random_mask(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto percent_lit = 10 + random() % 80;
  Grey8 mask(1 + static_cast<int>(random() % 70), 1 + static_cast<int>(random() % 30));
  for (std::size_t i = 0; i < mask.size(); ++i) mask.data()[i] = random() % 100 < percent_lit ? 255 : 0;
  return mask;
}

RC_GTEST_PROP(FindRegions, EqualsASlowFloodFill, ()) {
  const Grey8 mask = random_mask(*rc::gen::arbitrary<std::uint32_t>());
  RC_ASSERT(paint(find(mask), mask.width(), mask.height()) == flood_fill(mask));
}

RC_GTEST_PROP(FindRegions, EqualsOpenCvsConnectedComponents, ()) {
  Grey8 mask = random_mask(*rc::gen::arbitrary<std::uint32_t>());
  cv::Mat1i theirs;
  const int count = cv::connectedComponents(cv::Mat1b(mask.height(), mask.width(), mask.data()), theirs, 8, CV_32S);
  const Regions found = find(mask);
  RC_ASSERT(static_cast<int>(found.regions.size()) == count - 1);
  const Labels ours = paint(found, mask.width(), mask.height());
  std::map<int, int> ours_from_theirs;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const auto [entry, is_new] = ours_from_theirs.emplace(theirs(y, x), ours.at(x, y));
      RC_ASSERT(entry->second == ours.at(x, y));
    }
  }
}

RC_GTEST_PROP(FindRegions, CountsAndBoxesWhatItsRunsCover, ()) {
  const Regions found = find(random_mask(*rc::gen::arbitrary<std::uint32_t>()));
  for (const Region& region : found.regions) {
    int area = 0, left = 1000, right = -1;
    for (const Run& run : found.runs_of(region)) {
      area += run.right - run.left;
      left = std::min<int>(left, run.left);
      right = std::max(right, run.right - 1);
    }
    RC_ASSERT(area == region.area_px);
    RC_ASSERT(left == region.left && right == region.right);
    RC_ASSERT(found.runs_of(region).front().row == region.top);
    RC_ASSERT(found.runs_of(region).back().row == region.bottom);
  }
}

TEST(FindRegions, MergesDiagonalNeighbours) {
  EXPECT_EQ(find(ascii_mask({"##..",  //
                             "##..",  //
                             "..##",  //
                             "..##"}))
                .regions.size(),
            1U);
  EXPECT_EQ(find(ascii_mask({"...#",  //
                             "..#.",  //
                             ".#..",  //
                             "#..."}))
                .regions.size(),
            1U);
}

TEST(FindRegions, KeepsApartWhatDoesNotTouch) {
  const Regions found = find(ascii_mask({"##.##",  //
                                         "##.##",  //
                                         ".....",  //
                                         "##.##"}));
  EXPECT_THAT(found.regions, testing::SizeIs(4));
  EXPECT_THAT(found.regions, testing::Each(testing::Field(&Region::area_px, testing::AnyOf(4, 2))));
}

TEST(FindRegions, JoinsTheArmsOfAUThatMeetLate) {
  const Regions found = find(ascii_mask({"#...#..#",  //
                                         "#...#..#",  //
                                         "#...####",  //
                                         "#...#...",  //
                                         "#####..#"}));
  ASSERT_THAT(found.regions, testing::SizeIs(2));
  EXPECT_EQ(found.regions[0].area_px, 18);
  EXPECT_EQ(found.regions[1].area_px, 1);
}

TEST(FindRegions, FollowsASpiral) {
  EXPECT_THAT(find(ascii_mask({"#########",  //
                               "........#",  //
                               "#######.#",  //
                               "#.....#.#",  //
                               "#.###.#.#",  //
                               "#.#...#.#",  //
                               "#.#####.#",  //
                               "#.......#",  //
                               "#########"}))
                  .regions,
              testing::SizeIs(1));
}

TEST(FindRegions, LeavesHolesOutAndFindsWhatLiesInThem) {
  const Regions found = find(ascii_mask({"#####",  //
                                         "#...#",  //
                                         "#.#.#",  //
                                         "#...#",  //
                                         "#####"}));
  ASSERT_THAT(found.regions, testing::SizeIs(2));
  EXPECT_EQ(found.regions[0].area_px, 16);
  EXPECT_EQ(found.regions[1].area_px, 1);
  EXPECT_EQ(found.regions[1].left, 2);
  EXPECT_EQ(found.regions[1].top, 2);
}

TEST(FindRegions, ReachesTheBorder) {
  const Regions found = find(ascii_mask({"##.........#",  //
                                         "............",  //
                                         "............",  //
                                         "#.........##"}));
  ASSERT_THAT(found.regions, testing::SizeIs(4));
  EXPECT_EQ(found.regions[0].left, 0);
  EXPECT_EQ(found.regions[0].top, 0);
  EXPECT_EQ(found.regions[1].right, 11);
  EXPECT_EQ(found.regions[3].bottom, 3);
  EXPECT_EQ(found.regions[3].width_px(), 2);
  EXPECT_EQ(found.regions[3].middle_px(), Eigen::Vector2f(10.5F, 3));
}

TEST(FindRegions, FindsNothingInTheDarkAndOneRegionInTheLight) {
  EXPECT_THAT(find(Grey8(100, 50)).regions, testing::IsEmpty());
  const Regions lit = find(Grey8(100, 50, 255));
  ASSERT_THAT(lit.regions, testing::SizeIs(1));
  EXPECT_EQ(lit.regions[0].area_px, 5000);
}

TEST(FindRegions, ReadsRowsThatAreFartherApartThanWide) {
  const Grey8 mask = ascii_mask({"#.##",  //
                                 "#.##"});
  Regions found;
  RegionFinder().find(Mask(ImageView<std::uint8_t>{mask.data(), 2, 2, 4}), found);
  ASSERT_THAT(found.regions, testing::SizeIs(1));
  EXPECT_EQ(found.regions[0].area_px, 2);
}

TEST(FindRegions, ForgetsTheFrameBefore) {
  RegionFinder finder;
  Regions found;
  finder.find(Mask(Grey8(40, 40, 255).view()), found);
  finder.find(Mask(ascii_mask({"#.#"}).view()), found);
  EXPECT_THAT(found.regions, testing::SizeIs(2));
  EXPECT_THAT(found.runs, testing::SizeIs(2));
}

}  // namespace
}  // namespace slsd
