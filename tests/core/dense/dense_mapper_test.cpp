// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/dense_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "tests/core/dense/small_scene.hpp"
#include "tests/core/threads.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using namespace test;

TEST(DenseMapper, MeasuresAPlane) {
  const Score got = score(measure(tilted().frame.view()).map, tilted());
  EXPECT_GT(share(got.measured, got.lit), 0.97);
  EXPECT_LT(got.median_px, 0.03);
  EXPECT_LT(got.rms_mm, 0.35);
  EXPECT_EQ(got.gross, 0U);
  EXPECT_GT(got.over_sigma, 0.6);
  EXPECT_LT(got.over_sigma, 1.4);
  EXPECT_LT(share(got.beyond_three, got.measured), 0.02);
}

TEST(DenseMapper, DrawsNoSurfaceOverAShadow) {
  const Score got = score(measure(column().frame.view()).map, column());
  EXPECT_GT(share(got.measured, got.lit), 0.75);
  EXPECT_LT(share(got.gross, got.measured), 0.002);
  EXPECT_LT(share(got.unlit, got.measured), 0.001);
}

/// A strip of wall, too narrow for its symbols to be decoded, beside a column: growth runs off the column's edge there.
TEST(DenseMapper, DrawsNoSurfaceThatNoSymbolBears) {
  const auto strip = [](const Ray& ray) -> std::optional<double> {
    const auto wall = plane({0, 0, 2150}, {0, 0, 1})(ray), near = cylinder({40, 0, 1990}, {0, 1, 0}, 40)(ray);
    return near ? near : wall;
  };
  SimulationOptions options;
  options.seed = 4;
  const Seen seen = see(strip, draw_pattern(pattern()), options);
  const Score got = score(measure(seen.frame.view()).map, seen);
  EXPECT_GT(share(got.measured, got.lit), 0.8);
  EXPECT_LT(share(got.gross, got.measured), 0.003);
}

TEST(DenseSearch, FindsAPartThatIsNarrowerThanACodeword) {
  for (const double width_px : {14.0, 16.0, 20.0}) {
    const Seen seen = see(lath(width_px), draw_pattern(pattern()));
    const auto [symbols, map] = measure(seen.frame.view());
    const Score all = score(map, seen), near = score(nearer_than(2100, map), seen);
    EXPECT_GT(static_cast<double>(near.measured), 0.5 * width_px * 280) << width_px;
    EXPECT_LT(near.median_px, 0.1) << width_px;
    EXPECT_LT(share(near.gross, near.measured), 0.03) << width_px;  // so little tells few slopes
    EXPECT_LT(share(near.beyond_three, near.measured), 0.02) << width_px;
    EXPECT_LT(share(all.unlit, all.measured), 0.001) << width_px;
  }
}

TEST(DenseSearch, APartThatIsTooShortToTellStaysMissing) {
  const Seen seen = see(lath(16, 15), draw_pattern(pattern()));
  EXPECT_EQ(score(nearer_than(2100, measure(seen.frame.view()).map), seen).measured, 0U);
}

/// The frame of one surface, but where another image lights what is nearer than that.
Grey8 lit_by_another(const Seen& seen, const Grey8& image, double depth_mm) {
  const Grey8 other = see(seen.surface, image).frame;
  Grey8 frame = seen.frame;
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const Eigen::Vector3d ray = seen.rig.cameras[0].lens.undistort({x, y}).homogeneous();
      if (*seen.surface({Eigen::Vector3d::Zero(), ray}) < depth_mm) frame.at(x, y) = other.at(x, y);
    }
  }
  return frame;
}

TEST(DenseSearch, NothingOnAPartThatAnotherPatternLights) {
  const Grey8 image = draw_pattern(pattern());
  std::vector<Grey8> images;
  for (std::uint32_t seed = 2; seed < 5; ++seed) images.push_back(draw_pattern(small_pattern(seed)));
  Grey8 mirrored(image.width(), image.height()), a_row_lower = mirrored;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      mirrored.at(x, y) = image.at(image.width() - 1 - x, y);
      a_row_lower.at(x, y) = image.at(x, std::max(0, y - 9));
    }
  }
  images.push_back(mirrored), images.push_back(a_row_lower);
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (const double width_px : {16.0, 24.0, 60.0}) {
      const Seen seen = see(lath(width_px), image);
      const Grey8 frame = lit_by_another(seen, images[i], 2100);
      const DenseMap near = nearer_than(2100, measure(frame.view()).map);
      EXPECT_EQ(near.count(DensePixel::kMeasured), 0U) << i << " " << width_px;
    }
  }
}

/// Two walls that face the camera, one before the other; the edge between them is upright or leans.
/// @param edge_mm  place of the edge
Surface step_at(double lean, double edge_mm) {
  return [=](const Ray& ray) -> std::optional<double> {
    const auto far = plane({0, 0, 2150}, {0, 0, 1})(ray), near = plane({0, 0, 2060}, {0, 0, 1})(ray);
    const Eigen::Vector3d at = ray.origin + near.value_or(0) * ray.direction;
    return near && at.x() + lean * at.y() < edge_mm ? near : far;
  };
}

TEST(DenseMapper, SurfacesKeepTheirPixelsUpToTheEdgeBetweenThem) {
  DenseOptions up_to_the_edge;
  up_to_the_edge.prune_px = 1;
  std::size_t lit = 0, measured = 0, wrong = 0;
  // Edges that lie differently between the nodes of the grid.
  for (const double lean : {0.0, 0.1, 0.3}) {
    for (const double edge_mm : {0.0, 0.7, 1.4, 2.1}) {
      const Seen seen = see(step_at(lean, edge_mm), draw_pattern(pattern()));
      const DenseMap map = measure_by(up_to_the_edge, seen.frame.view()).map;
      for (int y = 10; y + 10 < map.height; ++y) {
        for (int x = 10; x + 10 < map.width; ++x) {
          const auto depth = [&](double u, double v) {
            const Eigen::Vector3d ray = seen.rig.cameras[0].lens.undistort({u, v}).homogeneous();
            return *seen.surface({Eigen::Vector3d::Zero(), ray});
          };
          const double here = depth(x, y);
          bool near_edge = false;
          for (const auto& [dx, dy] : {std::pair(3, 0), {-3, 0}, {0, 3}, {0, -3}})
            near_edge = near_edge || std::abs(depth(x + dx, y + dy) - here) > 50;
          if (!near_edge || !projector_from_camera({x, y}, seen.rig, seen.surface)) continue;
          ++lit;
          const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
          if (!map.measured(pixel)) continue;
          ++measured, wrong += std::abs(static_cast<double>(map.depth_mm[pixel]) - here) > 20;
        }
      }
    }
  }
  EXPECT_GT(lit, 10'000U);
  EXPECT_GT(share(measured, lit), 0.3);
  EXPECT_LT(share(wrong, measured), 0.1);
}

TEST(DenseMapper, WithoutPruningItReachesFartherAndNearerToWrong) {
  DenseOptions all;
  all.prune_px = 0;
  DenseOptions few;
  few.prune_px = 4;
  const auto count = [](const DenseOptions& options) {
    return measure_by(options, column().frame.view()).map.count(DensePixel::kMeasured);
  };
  const std::uint32_t whole = count(all), usual = count({}), pruned = count(few);
  EXPECT_GT(whole, usual + 500);
  EXPECT_GT(usual, pruned + 500);
}

/// A frame of a rig whose projector's image has moved since it was calibrated.
Measured measure_moved(double moved_px, float* offset_px) {
  Calibration moved = small_rig();
  moved.projector.cy += moved_px;
  const Grey8 frame = simulate(draw_pattern(pattern()), moved, kTilted, {});
  Decoder decoder = fresh_decoder();
  EXPECT_TRUE(decoder.decode(frame.view(), 255));
  DenseMapper mapper = fresh_mapper();
  SerialExecutor serial;
  const DecodedSymbols symbols = decoder.symbols();
  Measured measured{symbols.lattice->symbols.size(), mapper.measure(frame.view(), 255, symbols, serial)};
  *offset_px = mapper.epipolar_offset_px();
  return measured;
}

TEST(DenseMapper, TellsHowFarOffItsEpipolarLinesAFrameIs) {
  float offset_px = 0;
  for (const double moved_px : {-0.2, 0.0, 0.2, 0.6}) {
    const Score got = score(measure_moved(moved_px, &offset_px).map, tilted());
    EXPECT_NEAR(std::abs(offset_px), std::abs(moved_px), 0.02) << moved_px;
    EXPECT_GT(share(got.measured, got.lit), 0.97) << moved_px;
    EXPECT_LT(got.median_px, 0.03) << moved_px;
  }
}

TEST(DenseMapper, SigmaTellsOfACalibrationThatIsFarOff) {
  float offset_px = 0;
  const auto middle_sigma = [&](double moved_px) {
    const DenseMap map = measure_moved(moved_px, &offset_px).map;
    return map.sigma_mm[static_cast<std::size_t>(map.height / 2) * map.width + map.width / 2];
  };
  EXPECT_GT(middle_sigma(0.7), 2.5F);  // 0.5 px beyond what is usual, of 6.3 mm
  EXPECT_LT(middle_sigma(0.1), 1.F);
}

TEST(DenseMapper, NothingInNoise) {
  Grey8 frame(360, 280);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> level(0, 255);
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) frame.at(x, y) = static_cast<std::uint8_t>(level(random));
  EXPECT_EQ(measure(frame.view()).map.count(DensePixel::kMeasured), 0U);
}

TEST(DenseMapper, NothingInTheLightOfAnotherPattern) {
  const Seen seen = see(kTilted, draw_pattern(small_pattern(2)));
  EXPECT_EQ(measure(seen.frame.view()).map.count(DensePixel::kMeasured), 0U);
}

TEST(DenseMapper, NothingWhereThePatternIsCutOff) {
  Grey8 half = draw_pattern(pattern());
  for (int y = 0; y < half.height(); ++y)
    for (int x = half.width() / 2; x < half.width(); ++x) half.at(x, y) = 0;
  const Seen seen = see(kTilted, half);
  const DenseMap map = measure(seen.frame.view()).map;
  std::size_t lit = 0, beyond = 0;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (!map.measured(static_cast<std::size_t>(y) * map.width + x)) continue;
      const auto lit_by = projector_from_camera({x, y}, seen.rig, seen.surface);
      (lit_by && lit_by->x() < half.width() / 2 ? lit : beyond) += 1;
    }
  }
  EXPECT_GT(lit, 20'000U);
  EXPECT_EQ(beyond, 0U);
}

TEST(DenseMapper, NothingOnASaturatedPatch) {
  Grey8 frame = tilted().frame;
  for (int y = 100; y < 160; ++y)
    for (int x = 100; x < 180; ++x) frame.at(x, y) = 255;
  const DenseMap map = measure(frame.view()).map;
  for (int y = 104; y < 156; ++y)
    for (int x = 104; x < 176; ++x)
      ASSERT_FALSE(map.measured(static_cast<std::size_t>(y) * map.width + x)) << x << " " << y;
  EXPECT_GT(score(map, tilted()).measured, 70'000U);
}

TEST(DenseMapper, CountsEveryPixelOnce) {
  const DenseMap map = measure(column().frame.view()).map;
  EXPECT_EQ(std::accumulate(map.counts.begin(), map.counts.end(), 0U), map.pixels.size());
  for (const DensePixel reason : {DensePixel::kMeasured, DensePixel::kNotReached, DensePixel::kNoSupport,
                                  DensePixel::kUnlit, DensePixel::kAtAnEdge}) {
    EXPECT_GT(map.count(reason), 0U) << to_string(reason);
  }
}

TEST(DenseMapper, IntensityIsThatOfTheSurfaceInWhiteLight) {
  const DenseMap map = measure(tilted().frame.view()).map;
  std::vector<std::uint8_t> levels;
  for (std::size_t pixel = 0; pixel < map.pixels.size(); ++pixel)
    if (map.measured(pixel)) levels.push_back(map.intensity[pixel]);
  std::sort(levels.begin(), levels.end());
  EXPECT_NEAR(levels[levels.size() / 2], SimulationOptions{}.lit, 5);
  EXPECT_NEAR(levels[levels.size() / 20], SimulationOptions{}.lit, 15);
}

TEST(DenseMapper, MeasuresThroughACamerasToneCurve) {
  Grey8 toned = tilted().frame;
  for (int y = 0; y < toned.height(); ++y)
    for (int x = 0; x < toned.width(); ++x)
      toned.at(x, y) = static_cast<std::uint8_t>(std::lround(255 * std::pow(tilted().frame.at(x, y) / 255.0, 0.6)));
  DenseMapper mapper = fresh_mapper();
  const DenseMap map = measure(toned.view(), mapper).map;
  EXPECT_NEAR(mapper.tone_power(), 0.6, 0.06);
  const Score got = score(map, tilted()), straight = score(measure(tilted().frame.view()).map, tilted());
  EXPECT_LT(got.median_px, 1.3 * straight.median_px + 0.003);
  EXPECT_GT(got.measured, straight.measured * 97 / 100);
  std::vector<std::uint8_t> levels;
  for (std::size_t pixel = 0; pixel < map.pixels.size(); ++pixel)
    if (map.measured(pixel)) levels.push_back(map.intensity[pixel]);
  std::ranges::nth_element(levels, levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2));
  EXPECT_NEAR(levels[levels.size() / 2], 255 * std::pow(SimulationOptions{}.lit / 255, 0.6), 8);
}

TEST(DenseMapper, DepthBeyondTheWorkingRangeIsNone) {
  const Calibration rig = small_rig();
  DecodeOptions decode;
  Decoder decoder = Decoder::create(pattern(), rig, 0, decode).value();
  ASSERT_TRUE(decoder.decode(tilted().frame.view(), 255));
  decode.depth_min_mm = 2000;  // a half of the plane is nearer
  DenseMapper mapper(pattern(), rig, 0, decode);
  SerialExecutor executor;
  const DenseMap& map = mapper.measure(tilted().frame.view(), 255, decoder.symbols(), executor);
  EXPECT_GT(map.count(DensePixel::kMeasured), 20'000U);
  EXPECT_GT(map.count(DensePixel::kOutOfDepthRange), 500U);
  EXPECT_FALSE(std::ranges::any_of(map.depth_mm, [](float depth) { return depth < 2000; }));
}

TEST(DenseMapper, SixteenBitsAreAsGood) {
  const Score got = score(measure(sixteen_bits(tilted().frame).view(), 65535).map, tilted());
  EXPECT_GT(share(got.measured, got.lit), 0.97);
  EXPECT_LT(got.rms_mm, 0.35);
}

TEST(DenseMapper, ThreadsChangeNothing) {
  test::Threads threads(2);
  DenseMapper mapper = fresh_mapper();
  EXPECT_TRUE(same(measure(column().frame.view()).map, measure(column().frame.view(), mapper, 255, &threads).map));
}

TEST(DenseMapper, ClonesMeasureTheSame) {
  const Clone usual = clone_in_use.exchange(Clone::kPlain);
  const DenseMap plain = measure(column().frame.view()).map;
  for (const Clone clone : clones_here()) {
    clone_in_use = clone;
    const DenseMap map = measure(column().frame.view()).map;
    if (clone == Clone::kAvx2) {
      EXPECT_TRUE(same(plain, map));
    }
    // A sum beside a gate may be rounded to its other side.
    std::size_t other = 0;
    for (std::size_t pixel = 0; pixel < map.pixels.size(); ++pixel) {
      const bool both = map.measured(pixel) && plain.measured(pixel);
      other += map.pixels[pixel] != plain.pixels[pixel] ||
               (both && std::abs(map.depth_mm[pixel] - plain.depth_mm[pixel]) > 0.1F * plain.sigma_mm[pixel]);
    }
    EXPECT_LT(share(other, map.pixels.size()), 0.002);
  }
  clone_in_use = usual;
}

TEST(DenseMapper, AFrameDoesNotDependOnTheOneBefore) {
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  SerialExecutor executor;
  for (const Seen* seen : {&tilted(), &column()}) {
    ASSERT_TRUE(decoder.decode(seen->frame.view(), 255));
    const DenseMap& map = mapper.measure(seen->frame.view(), 255, decoder.symbols(), executor);
    EXPECT_TRUE(same(map, measure(seen->frame.view()).map));
  }
}

TEST(DenseMapper, AllocatesNothingAfterTheFirstFrame) {
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  SerialExecutor executor;
  ASSERT_TRUE(decoder.decode(tilted().frame.view(), 255));
  const DecodedSymbols symbols = decoder.symbols();
  (void)mapper.measure(tilted().frame.view(), 255, symbols, executor);
  const auto before = test::allocations();
  (void)mapper.measure(tilted().frame.view(), 255, symbols, executor);
  EXPECT_EQ(test::allocations(), before);
}

TEST(DenseOptions, AreChecked) {
  EXPECT_TRUE(DenseOptions{}.validate());
  for (const int stride : {0, 17}) EXPECT_FALSE((DenseOptions{stride, 1.5}.validate())) << stride;
  for (const double prune : {-0.1, 16.1, std::nan("")}) EXPECT_FALSE((DenseOptions{4, prune}.validate())) << prune;
  for (const int stride : {1, 16}) EXPECT_TRUE((DenseOptions{stride, 0}.validate()));
}

TEST(DenseMapper, EveryStrideMeasures) {
  for (const int stride : {2, 7, 16}) {
    DenseOptions options;
    options.stride_px = stride;
    const Score got = score(measure_by(options, tilted().frame.view()).map, tilted());
    EXPECT_GT(share(got.measured, got.lit), stride < 10 ? 0.93 : 0.7) << stride;
    EXPECT_EQ(got.gross, 0U) << stride;
  }
}

}  // namespace
}  // namespace slsd
