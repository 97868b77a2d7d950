// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "core/dense/dense_mapper.hpp"
#include "tests/core/dense/small_scene.hpp"
#include "tests/core/threads.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using namespace test;

/// Frames one after the other, as a subscriber has them measured.
class Stream {
 public:
  const DenseMap& next(const Grey8& frame) {
    EXPECT_TRUE(decoder_.decode(frame.view(), 255));
    return mapper_.measure_next(frame.view(), 255, decoder_.symbols(), executor_);
  }
  [[nodiscard]] double followed(const DenseMap& map) const {
    const double nodes = map.count(DensePixel::kMeasured) / 16.0;  // one to a square of the stride
    return static_cast<double>(mapper_.followed_nodes()) / std::max(1.0, nodes);
  }

 private:
  Decoder decoder_ = fresh_decoder();
  DenseMapper mapper_ = fresh_mapper();
  SerialExecutor executor_;
};

Seen see_again(const Surface& surface, std::uint32_t seed, double lit = SimulationOptions{}.lit) {
  SimulationOptions options;
  options.seed = seed, options.lit = lit;
  return see(surface, draw_pattern(pattern()), options);
}

/// Errors of the mean of several maps, mm, where all have a point.
double rms_of_mean(const std::vector<DenseMap>& maps, const Seen& seen) {
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t pixel = 0; pixel < maps[0].pixels.size(); ++pixel) {
    if (!std::ranges::all_of(maps, [&](const DenseMap& map) { return map.measured(pixel); })) continue;
    double sum = 0;
    for (const DenseMap& map : maps) sum += static_cast<double>(map.depth_mm[pixel]);
    const Eigen::Vector2d at(static_cast<double>(pixel % 360), static_cast<double>(pixel / 360));
    const Eigen::Vector3d ray = seen.rig.cameras[0].lens.undistort(at).homogeneous();
    const double off = sum / static_cast<double>(maps.size()) - *seen.surface({Eigen::Vector3d::Zero(), ray});
    if (std::abs(off) < 2) squares += off * off, ++count;
  }
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(DenseStream, AStillSceneIsFollowedAsExactlyAndItsNoiseIsEachFramesOwn) {
  Stream stream;
  std::vector<DenseMap> followed, single;
  for (std::uint32_t frame = 1; frame <= 8; ++frame) {
    const Seen seen = see_again(column_and_wall, frame);
    const DenseMap& map = stream.next(seen.frame);
    if (frame <= 2) continue;
    EXPECT_GT(stream.followed(map), 0.9) << frame;
    followed.push_back(map), single.push_back(measure(seen.frame.view()).map);
    const Score got = score(followed.back(), seen), alone = score(single.back(), seen);
    EXPECT_NEAR(share(got.measured, got.lit), share(alone.measured, alone.lit), 0.01);
    EXPECT_LT(got.rms_mm, 1.1 * alone.rms_mm) << frame;
    EXPECT_LT(share(got.gross, got.measured), share(alone.gross, alone.measured) + 0.0005) << frame;
    EXPECT_LT(share(got.unlit, got.measured), share(alone.unlit, alone.measured) + 0.0005) << frame;
    EXPECT_LT(share(got.beyond_three, got.measured), share(alone.beyond_three, alone.measured) + 0.005) << frame;
  }
  // What the mean of several gains is gone where they share their noise.
  EXPECT_LT(rms_of_mean(followed, column()), 1.06 * rms_of_mean(single, column()));
}

TEST(DenseStream, AllocatesNothingWhileTheSceneStandsStill) {
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  SerialExecutor executor;
  const Seen again = see_again(kTilted, 2);
  ASSERT_TRUE(decoder.decode(tilted().frame.view(), 255));
  const DecodedSymbols symbols = decoder.symbols();
  for (int frame = 0; frame < 3; ++frame) (void)mapper.measure_next(tilted().frame.view(), 255, symbols, executor);
  const auto before = test::allocations();
  (void)mapper.measure_next(again.frame.view(), 255, symbols, executor);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_GT(mapper.followed_nodes(), 4000U);
}

TEST(DenseStream, ThreadsAndLanesChangeNothing) {
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  DenseMapper other = mapper.another();
  SerialExecutor serial;
  test::Threads threads(2);
  const Seen again = see_again(kTilted, 2);
  ASSERT_TRUE(decoder.decode(tilted().frame.view(), 255));
  const DecodedSymbols symbols = decoder.symbols();
  for (int frame = 0; frame < 2; ++frame) (void)mapper.measure_next(tilted().frame.view(), 255, symbols, serial);
  const DenseMap one = mapper.measure_next(again.frame.view(), 255, symbols, serial);
  EXPECT_TRUE(same(one, mapper.measure_next(again.frame.view(), 255, symbols, threads)));
  EXPECT_TRUE(same(one, other.measure_next(again.frame.view(), 255, symbols, serial))) << "goes on from the same frame";
  EXPECT_GT(other.followed_nodes(), 4000U);
}

/// The third frame of a still scene, of another noise than the first two.
template <class Image>
DenseMap third_of_stream(const Image& first, const Image& third, double full) {
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  SerialExecutor executor;
  for (const Image* frame : {&first, &first, &third}) {
    EXPECT_TRUE(decoder.decode(frame->view(), full));
    (void)mapper.measure_next(frame->view(), full, decoder.symbols(), executor);
  }
  EXPECT_GT(mapper.followed_nodes(), 4000U);
  return mapper.measure_next(third.view(), full, decoder.symbols(), executor);
}

TEST(DenseStream, ClonesFollowTheSame) {
  const Grey8 third = see_again(kTilted, 2).frame;
  const Clone usual = clone_in_use.exchange(Clone::kPlain);
  const DenseMap plain = third_of_stream(tilted().frame, third, 255);
  for (const Clone clone : clones_here()) {
    clone_in_use = clone;
    const DenseMap map = third_of_stream(tilted().frame, third, 255);
    if (clone == Clone::kAvx2) {
      EXPECT_TRUE(same(plain, map));
    }
    EXPECT_NEAR(share(map.count(DensePixel::kMeasured), plain.count(DensePixel::kMeasured)), 1, 0.002);
  }
  clone_in_use = usual;
}

TEST(DenseStream, SixteenBitsAreAsGood) {
  const Seen again = see_again(kTilted, 2);
  const Score got = score(third_of_stream(sixteen_bits(tilted().frame), sixteen_bits(again.frame), 65535), again);
  EXPECT_GT(share(got.measured, got.lit), 0.97);
  EXPECT_LT(got.rms_mm, 0.35);
}

TEST(DenseStream, WhatMovesIsNeverDrawnWhereItWas) {
  for (const double step_mm : {0.02, 0.2, 1.0, 6.0, 40.0}) {
    Stream stream;
    for (std::uint32_t frame = 1; frame <= 7; ++frame) {
      // Still, and then on the move, sideways and towards the camera.
      const double moved = frame < 4 ? 0 : step_mm * (frame - 3);
      const auto surface = [&](const Ray& ray) -> std::optional<double> {
        const auto wall = plane({0, 0, 2150}, {0, 0, 1})(ray),
                   column = cylinder({moved, 0, 2030 - moved}, {0, 1, 0}, 40)(ray);
        return column ? column : wall;
      };
      const Seen seen = see_again(surface, frame);
      const DenseMap one = measure(seen.frame.view()).map;
      const Score got = score(stream.next(seen.frame), seen), alone = score(one, seen);
      EXPECT_NEAR(share(got.measured, got.lit), share(alone.measured, alone.lit), 0.015) << step_mm << ' ' << frame;
      EXPECT_LT(got.rms_mm, 1.1 * alone.rms_mm) << step_mm << ' ' << frame;
      EXPECT_LT(share(got.gross, got.measured), share(alone.gross, alone.measured) + 0.001) << step_mm << ' ' << frame;
      EXPECT_LT(share(got.unlit, got.measured), share(alone.unlit, alone.measured) + 0.001) << step_mm << ' ' << frame;
    }
  }
}

TEST(DenseStream, SlowDriftIsFollowedToItsEnd) {
  Stream stream;
  double squares = 0, squares_alone = 0;
  for (std::uint32_t frame = 1; frame <= 40; ++frame) {
    const double moved = 0.05 * frame;
    const Seen seen = see_again(plane({0, 0, 2000 - moved}, {0.3, 0.15, -1}), frame);
    const DenseMap& map = stream.next(seen.frame);
    if (frame % 8 != 0) continue;
    const Score got = score(map, seen), alone = score(measure(seen.frame.view()).map, seen);
    squares += got.rms_mm * got.rms_mm, squares_alone += alone.rms_mm * alone.rms_mm;
    EXPECT_LT(rms_of_mean({map}, seen), 0.3) << frame;
  }
  // A few pixels make half of a frame's squares.
  EXPECT_LT(squares, 1.2 * squares_alone);
}

TEST(DenseStream, TellsHowFarAKnockedRigIsOffItsEpipolarLines) {
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  SerialExecutor executor;
  std::size_t followed = 0;
  for (std::uint32_t frame = 1; frame <= 8; ++frame) {
    Calibration moved = small_rig();
    const double off_px = frame < 4 ? 0 : 0.02 * (frame - 3);
    moved.projector.cy += off_px;
    SimulationOptions options;
    options.seed = frame;
    const Grey8 seen = simulate(draw_pattern(pattern()), moved, kTilted, options);
    ASSERT_TRUE(decoder.decode(seen.view(), 255));
    (void)mapper.measure_next(seen.view(), 255, decoder.symbols(), executor);
    EXPECT_NEAR(std::abs(mapper.epipolar_offset_px()), off_px, 0.01) << frame;
    followed += mapper.followed_nodes() > 2000;
  }
  EXPECT_GE(followed, 4U);
}

TEST(DenseStream, LightThatChangesMovesNothing) {
  Stream stream;
  for (std::uint32_t frame = 1; frame <= 8; ++frame) {
    const Seen seen = see_again(kTilted, frame, frame < 4 ? 170 : 170 - 4.0 * frame);
    const Score got = score(stream.next(seen.frame), seen), alone = score(measure(seen.frame.view()).map, seen);
    EXPECT_LT(got.rms_mm, 1.1 * alone.rms_mm) << frame;
    EXPECT_NEAR(share(got.measured, got.lit), share(alone.measured, alone.lit), 0.01) << frame;
  }
}

TEST(DenseStream, NothingStaysOfAPatternThatIsGone) {
  const auto noise = [] {
    Grey8 frame(360, 280);
    std::mt19937 random(3);
    std::uniform_int_distribution<int> level(0, 255);
    for (int y = 0; y < frame.height(); ++y)
      for (int x = 0; x < frame.width(); ++x) frame.at(x, y) = static_cast<std::uint8_t>(level(random));
    return frame;
  }();
  for (const Grey8& after :
       {noise, Grey8(360, 280), Grey8(360, 280, 255), see(kTilted, draw_pattern(small_pattern(2))).frame}) {
    Stream stream;
    for (std::uint32_t frame = 1; frame <= 4; ++frame) (void)stream.next(see_again(kTilted, frame).frame);
    EXPECT_EQ(stream.next(after).count(DensePixel::kMeasured), 0U);
    EXPECT_EQ(stream.next(after).count(DensePixel::kMeasured), 0U);
  }
}

TEST(DenseSearch, AStreamKeepsWhatItFound) {
  Stream stream;
  for (std::uint32_t frame = 1; frame <= 5; ++frame) {
    const Seen seen = see_again(lath(16), frame);
    const Score got = score(nearer_than(2100, stream.next(seen.frame)), seen);
    EXPECT_GT(got.measured, 2'200U) << frame;
    EXPECT_LT(share(got.gross, got.measured), 0.03) << frame;
    EXPECT_LT(share(got.beyond_three, got.measured), 0.02) << frame;
  }
}

}  // namespace
}  // namespace slsd
