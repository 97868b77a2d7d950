// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/clean_map.hpp"

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

SerialExecutor cleans_alone;

using Drawing = std::vector<std::string_view>;

/// '#' a pixel at 1 m that is firm, 'o' one that is not, '2' one at 2 m, '.' none.
DenseMap map_of(const Drawing& rows) {
  DenseMap map;
  map.reset(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()));
  for (std::size_t y = 0; y < rows.size(); ++y) {
    for (std::size_t x = 0; x < rows[y].size(); ++x) {
      const std::size_t pixel = y * rows[0].size() + x;
      if (rows[y][x] == '.') continue;
      map.depth_mm[pixel] = rows[y][x] == '2' ? 2000 : 1000, map.sigma_mm[pixel] = 1, map.intensity[pixel] = 100;
      map.pixels[pixel] = DensePixel::kMeasured;
      map.firm[pixel] = rows[y][x] != 'o';
    }
  }
  return map;
}

std::string left_of(const DenseMap& map) {
  std::string drawing;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      const bool there = map.measured(pixel);
      EXPECT_EQ(there, map.depth_mm[pixel] > 0);
      EXPECT_EQ(there, map.sigma_mm[pixel] > 0);
      EXPECT_EQ(there, map.intensity[pixel] > 0);
      drawing += there ? '#' : '.';
    }
    drawing += '\n';
  }
  return drawing;
}

SurfaceSeed seed_at(float x, float y, float depth_mm = 1000) {
  return {{x, y}, {1 / depth_mm, 0, 0}};
}

TEST(DropSmallComponents, KeepsWhatIsLargeEnough) {
  DenseMap map = map_of({"##...#", "##...#", "......", "###..."});
  const std::vector<SurfaceSeed> seeds = {seed_at(0, 0), seed_at(5, 1), seed_at(2.3F, 2.8F)};
  MapCleaner().drop_small_components(map, 3, seeds, cleans_alone);
  EXPECT_EQ(left_of(map), "##....\n##....\n......\n###...\n");
  EXPECT_EQ(map.pixels[5], DensePixel::kSmallComponent);
}

TEST(DropSmallComponents, AJumpInDepthParts) {
  DenseMap map = map_of({"####22", "####22"});
  const std::vector<SurfaceSeed> seeds = {seed_at(1, 1), seed_at(5, 1, 2000)};
  MapCleaner().drop_small_components(map, 5, seeds, cleans_alone);
  EXPECT_EQ(left_of(map), "####..\n####..\n");
}

TEST(DropSmallComponents, WhatBearsNoSymbolHasToBeFarLarger) {
  const Drawing rows = {"###############..........", ".........................", "#########################"};
  const auto after = [&](const std::vector<SurfaceSeed>& seeds) {
    DenseMap map = map_of(rows);
    MapCleaner().drop_small_components(map, 1, seeds, cleans_alone);
    return map.measured(0);
  };
  EXPECT_FALSE(after({}));
  EXPECT_TRUE(after({seed_at(7, 0)}));
  EXPECT_FALSE(after({seed_at(7, 0, 2000)})) << "a symbol behind it";
  EXPECT_FALSE(after({seed_at(7, 1), seed_at(7, 2), seed_at(20, 0), seed_at(-3, 0), seed_at(9, 40)})) << "beside it";
  DenseMap map = map_of(rows);
  MapCleaner().drop_small_components(map, 1, {}, cleans_alone);
  EXPECT_TRUE(map.measured(50)) << "25 pixels are enough by themselves";
}

TEST(Prune, TakesWhatIsNearerToAHoleThanAsked) {
  const Drawing rows = {"......", ".#####", ".#####", ".#####", ".#####"};
  DenseMap map = map_of(rows);
  MapCleaner().prune(map, 0, 0, cleans_alone);
  EXPECT_EQ(left_of(map), "......\n.#####\n.#####\n.#####\n.#####\n");
  MapCleaner().prune(map, 1, 0, cleans_alone);
  EXPECT_EQ(left_of(map), "......\n......\n..####\n..####\n..####\n");
  EXPECT_EQ(map.pixels[7], DensePixel::kAtAnEdge);
  map = map_of(rows);
  MapCleaner().prune(map, 2, 0, cleans_alone);
  EXPECT_EQ(left_of(map), "......\n......\n......\n...###\n...###\n");
}

TEST(Prune, ASmallHoleWithinOneSurfaceIsNoEdge) {
  const Drawing rows = {"########", "#..##.##", "#.###..#", "########"};
  const auto after = [&](const Drawing& drawing, std::size_t most) {
    DenseMap map = map_of(drawing);
    MapCleaner().prune(map, 1, most, cleans_alone);
    return left_of(map);
  };
  EXPECT_EQ(after(rows, 3), "########\n#..##.##\n#.###..#\n########\n");
  EXPECT_NE(after(rows, 2), after(rows, 3));
  // At the map's border, or between two surfaces, nobody knows what is there.
  EXPECT_EQ(after({"#.####", "######"}, 9), "...###\n#.####\n");
  EXPECT_EQ(after({"#####", "##.##", "#####"}, 9), "#####\n##.##\n#####\n");
  EXPECT_EQ(after({"#####", "##.#2", "#####"}, 9), "####.\n##...\n####.\n") << "the jump alone";
  EXPECT_EQ(after({"#####", "##.22", "#####"}, 9).substr(6, 5), "#....");
}

TEST(Prune, TakesBothSidesOfAJump) {
  DenseMap map = map_of({"###222", "###222", "###222"});
  MapCleaner().prune(map, 1, 0, cleans_alone);
  EXPECT_EQ(left_of(map), "##..##\n##..##\n##..##\n");
}

TEST(DropUnlitRims, KeepsWhatFirmPixelsEnclose) {
  DenseMap map = map_of({"##o##ooo", "##o##ooo", "##o##ooo", "##o##ooo"});
  MapCleaner().drop_unlit_boundaries(map, 1, cleans_alone);
  EXPECT_EQ(left_of(map), "#####...\n#####...\n#####...\n#####...\n");
  EXPECT_EQ(map.pixels[5], DensePixel::kUnlit);
}

TEST(DropUnlitRims, BridgesTwiceItsReachAcrossWords) {
  const std::string lit(60, '#'), row = lit + "oooooo" + lit, whole(126, '#');
  DenseMap map = map_of({row, row});
  MapCleaner().drop_unlit_boundaries(map, 3, cleans_alone);
  EXPECT_EQ(left_of(map), whole + "\n" + whole + "\n");
  map = map_of({row, row});
  MapCleaner().drop_unlit_boundaries(map, 2, cleans_alone);
  EXPECT_EQ(left_of(map).find('.'), 60U);
}

}  // namespace
}  // namespace slsd
