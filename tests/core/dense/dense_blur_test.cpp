// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <utility>

#include "tests/core/appearance/plain_light.hpp"
#include "tests/core/dense/small_scene.hpp"
#include "tests/drivers/allocations.hpp"

namespace slsd {
namespace {

using namespace test;

constexpr double kFull = 65535;
/// Interpolation between a field's samples narrows the pattern, see PatternField. A blur wider by this makes up for it.
constexpr double kOfSampling = 0.135;  // projector px

/// The blur at a pixel and a depth, projector px.
using Blur = std::function<double(int x, int y, double depth_mm)>;

/// The frame of a surface under the pattern, blurred in the projector's plane: the exact integral, pixel by pixel.
Grey16 exact_frame(const Surface& surface, const Blur& blur_px) {
  const Calibration rig = small_rig();
  const Grey8 image = draw_pattern(pattern());
  const Lens& lens = rig.cameras[0].lens;
  Grey16 frame(lens.width_px, lens.height_px);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const Eigen::Vector3d ray = lens.undistort({x, y}).homogeneous();
      const auto depth = surface({Eigen::Vector3d::Zero(), ray});
      const Eigen::Vector2d p = rig.projector.project(rig.cameras[0].projector_from_camera * (*depth * ray));
      frame.at(x, y) = static_cast<std::uint16_t>(
          std::lround(0.8 * kFull * (0.05 + 0.9 * plain_light(image, blur_px(x, y, *depth), p.x(), p.y()))));
    }
  }
  return frame;
}

struct OfBlur {
  double median_px, blur_px, measured;
};

OfBlur measure_blurred(double blur_px) {
  const Grey16 frame = exact_frame(kTilted, [=](int, int, double) { return blur_px; });
  const Calibration rig = small_rig();
  Decoder decoder = Decoder::create(pattern(), rig, 0, {}).value();
  EXPECT_TRUE(decoder.decode(frame.view(), kFull));
  DenseMapper mapper(pattern(), rig, 0, {});
  SerialExecutor serial;
  const DenseMap& map = mapper.measure(frame.view(), kFull, decoder.symbols(), serial);
  const Score got = score(map, {rig, kTilted, {}});
  EXPECT_EQ(got.gross, 0U) << blur_px;
  return {got.median_px, static_cast<double>(mapper.blur_sigma_px()), share(got.measured, got.lit)};
}

// Fields of seven fixed blurs made the error 0.03 to 0.04 px between two of them.
TEST(DenseBlur, IsMeasuredWhateverItIs) {
  std::mt19937 random(20261128);
  for (double rung = 0.4; rung < 1.6; rung *= 1.19) {
    const double blur_px = rung * std::uniform_real_distribution(1.0, 1.19)(random);
    const OfBlur got = measure_blurred(blur_px);
    EXPECT_NEAR(got.blur_px, std::hypot(blur_px, kOfSampling), 0.015 * blur_px);
    EXPECT_GT(got.measured, 0.95) << blur_px;
    EXPECT_LT(got.median_px, 0.004 / blur_px) << blur_px;
  }
}

/// Median error, px, nearer and farther than 2.1 m, of a column before a wall. @param next  as frames of a stream
std::array<double, 2> errors_before_a_wall(const Blur& blur_px, bool next) {
  const Grey16 frame = exact_frame(column_and_wall, blur_px);
  const Calibration rig = small_rig();
  Decoder decoder = Decoder::create(pattern(), rig, 0, {}).value();
  DenseMapper mapper(pattern(), rig, 0, {});
  SerialExecutor serial;
  DenseMap map;
  for (int i = 0; i < (next ? 3 : 1); ++i) {
    EXPECT_TRUE(decoder.decode(frame.view(), kFull));
    map = next ? mapper.measure_next(frame.view(), kFull, decoder.symbols(), serial)
               : mapper.measure(frame.view(), kFull, decoder.symbols(), serial);
  }
  EXPECT_EQ(mapper.followed_nodes() > 0, next);
  DenseMap farther = map;
  for (std::size_t pixel = 0; pixel < map.pixels.size(); ++pixel)
    if (map.measured(pixel) && map.depth_mm[pixel] < 2100) farther.drop(pixel, DensePixel::kNotReached);
  const Seen seen{rig, column_and_wall, {}};
  return {score(nearer_than(2100, std::move(map)), seen).median_px, score(farther, seen).median_px};
}

TEST(DenseBlur, IsMeasuredAtEachDepth) {
  const Blur even = [](int, int, double) { return 0.6; };
  const Blur out_of_focus = [](int, int, double depth_mm) { return depth_mm > 2100 ? 0.75 : 0.55; };
  for (const bool next : {false, true}) {
    const auto [near, far] = errors_before_a_wall(out_of_focus, next);
    const auto [near_even, far_even] = errors_before_a_wall(even, next);
    EXPECT_LT(near, 1.5 * near_even) << next;
    EXPECT_LT(far, 1.5 * far_even) << next;
  }
}

TEST(DenseBlur, AllocatesNothingAfterTheFirstFrames) {
  const Grey16 frame =
      exact_frame(column_and_wall, [](int, int, double depth_mm) { return depth_mm > 2100 ? 0.75 : 0.55; });
  Decoder decoder = fresh_decoder();
  DenseMapper mapper = fresh_mapper();
  SerialExecutor serial;
  ASSERT_TRUE(decoder.decode(frame.view(), kFull));
  const DecodedSymbols symbols = decoder.symbols();
  for (int i = 0; i < 2; ++i) (void)mapper.measure(frame.view(), kFull, symbols, serial);
  const std::uint64_t before = allocations();
  (void)mapper.measure(frame.view(), kFull, symbols, serial);
  EXPECT_EQ(allocations(), before);
}

TEST(DenseBlur, IsMeasuredTowardTheCorners) {
  const Blur toward_corners = [](int x, int y, double) {
    return 0.5 + 0.22 * (std::pow(x - 180, 2) + std::pow(y - 140, 2)) / 52000;
  };
  const Blur even = [](int, int, double) { return 0.6; };
  const auto [near, far] = errors_before_a_wall(toward_corners, false);
  const auto [near_even, far_even] = errors_before_a_wall(even, false);
  EXPECT_LT(far, 1.5 * far_even);
  EXPECT_LT(near, 1.5 * near_even);
}

}  // namespace
}  // namespace slsd
