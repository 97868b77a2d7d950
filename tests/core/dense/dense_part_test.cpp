// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/dense/dense_mapper.hpp"
#include "tests/core/dense/small_scene.hpp"
#include "tests/core/threads.hpp"

namespace slsd {
namespace {

using namespace test;

const PixelRectangle kPart{150, 110, 240, 170};

/// A column in front of a wall that leans.
std::optional<double> column_and_leaning_wall(const Ray& ray) {
  const auto wall = plane({0, 0, 2150}, {0.2, 0.1, -1})(ray), column = cylinder({0, 0, 2030}, {0, 1, 0}, 40)(ray);
  return column ? column : wall;
}

const Seen& scene() {
  static const Seen seen = see(column_and_leaning_wall, draw_pattern(pattern()));
  return seen;
}

DenseMap part_of_scene(DenseMapper& mapper, const PixelRectangle& part, Executor* executor = nullptr) {
  mapper.set_part(part);
  return measure(scene().frame.view(), mapper, 255, executor).map;
}

/// Checks that the part has the points of the whole frame, and nothing around them.
void expect_part_of(const DenseMap& whole, const DenseMap& map, const PixelRectangle& part) {
  ASSERT_EQ(map.width, whole.width);
  ASSERT_EQ(map.height, whole.height);
  std::size_t inside = 0, other_status = 0, measured = 0;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      if (!part.contains(x, y)) {
        ASSERT_EQ(map.pixels[pixel], DensePixel::kOutsideBox) << x << " " << y;
        ASSERT_TRUE(std::isnan(map.depth_mm[pixel]) && std::isnan(map.sigma_mm[pixel]));
        ASSERT_EQ(map.intensity[pixel], 0);
        continue;
      }
      ++inside, other_status += map.pixels[pixel] != whole.pixels[pixel];
      if (!map.measured(pixel) || !whole.measured(pixel)) continue;
      ++measured;
      ASSERT_NEAR(map.depth_mm[pixel], whole.depth_mm[pixel], 0.02F * whole.sigma_mm[pixel]) << x << " " << y;
      ASSERT_NEAR(map.sigma_mm[pixel], whole.sigma_mm[pixel], 0.01F * whole.sigma_mm[pixel]);
      ASSERT_NEAR(map.intensity[pixel], whole.intensity[pixel], 1);
    }
  }
  EXPECT_GT(measured, inside / 2);
  EXPECT_LE(other_status, inside / 200);
  EXPECT_EQ(map.count(DensePixel::kMeasured) + map.count(DensePixel::kOutsideBox) + map.count(DensePixel::kNotReached) +
                map.count(DensePixel::kNoSupport) + map.count(DensePixel::kOccluded) + map.count(DensePixel::kUnlit) +
                map.count(DensePixel::kSmallComponent) + map.count(DensePixel::kAtAnEdge),
            map.pixels.size());
  EXPECT_GE(map.count(DensePixel::kOutsideBox), map.pixels.size() - inside);
}

TEST(DensePart, HasThePointsOfTheWholeFrame) {
  DenseMapper mapper = fresh_mapper();
  const DenseMap whole = measure(scene().frame.view(), mapper).map;
  for (const PixelRectangle& part : {kPart, PixelRectangle{0, 0, 90, 80}, PixelRectangle{301, 203, 360, 280},
                                     PixelRectangle{1, 99, 359, 151}, PixelRectangle{0, 0, 360, 280}})
    expect_part_of(whole, part_of_scene(mapper, part), part);
}

TEST(DensePart, LeavesNothingOfTheFrameBefore) {
  DenseMapper mapper = fresh_mapper();
  const DenseMap first = part_of_scene(mapper, kPart);
  const DenseMap other = part_of_scene(mapper, {0, 0, 90, 80});
  EXPECT_EQ(other.count(DensePixel::kOutsideBox), other.pixels.size() - 90U * 80U);
  const DenseMap again = part_of_scene(mapper, kPart);
  EXPECT_EQ(again.pixels, first.pixels);
  EXPECT_EQ(again.intensity, first.intensity);
  mapper.set_part(std::nullopt);
  const DenseMap whole = measure(scene().frame.view(), mapper).map, fresh = measure(scene().frame.view()).map;
  EXPECT_EQ(whole.pixels, fresh.pixels);
  EXPECT_EQ(whole.intensity, fresh.intensity);
  EXPECT_EQ(whole.count(DensePixel::kOutsideBox), 0U);
}

TEST(DensePart, IsTheSameWithSeveralWorkers) {
  DenseMapper mapper = fresh_mapper(), threaded = fresh_mapper();
  Threads threads(3);
  const DenseMap alone = part_of_scene(mapper, kPart), together = part_of_scene(threaded, kPart, &threads);
  EXPECT_EQ(alone.pixels, together.pixels);
  EXPECT_EQ(alone.intensity, together.intensity);
}

TEST(DensePart, WithoutPixelsHasNoPoint) {
  DenseMapper mapper = fresh_mapper();
  const DenseMap map = part_of_scene(mapper, {});
  EXPECT_EQ(map.width, 360);
  EXPECT_EQ(map.count(DensePixel::kOutsideBox), map.pixels.size());
}

/// In a stream, too, each frame of a part is measured afresh.
TEST(DensePart, OfAStreamIsThatOfAScan) {
  DenseMapper mapper = fresh_mapper();
  const DenseMap single = part_of_scene(mapper, kPart);
  Decoder decoder = fresh_decoder();
  SerialExecutor serial;
  for (int frame = 0; frame < 3; ++frame) {
    ASSERT_TRUE(decoder.decode(scene().frame.view(), 255));
    const DenseMap& next = mapper.measure_next(scene().frame.view(), 255, decoder.symbols(), serial);
    EXPECT_EQ(next.pixels, single.pixels) << frame;
  }
}

}  // namespace
}  // namespace slsd
