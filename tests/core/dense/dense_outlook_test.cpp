// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/dense_outlook.hpp"

#include <gtest/gtest.h>

#include "core/decode/decoder.hpp"
#include "core/dense/dense_mapper.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

Pattern pattern_of(int symbol_size_px, int spacing_px) {
  PatternOptions options;
  options.symbol_size_px = symbol_size_px, options.spacing_px = spacing_px;
  return make_pattern(options).value();
}

TEST(DenseOutlook, SmallerSymbolsResolveMore) {
  const Calibration rig = paper_rig();
  const auto outlook = [&](const Pattern& pattern) {
    return dense_outlook(pattern, rig, 0, {}, DenseMapper(pattern, rig, 0, {}).window_px());
  };
  const DenseOutlook coarse = outlook(pattern_of(16, 2)), fine = outlook(pattern_of(8, 1));
  EXPECT_NEAR(coarse.pitch_px, 2 * fine.pitch_px, 1e-6);
  EXPECT_GT(coarse.thinnest_part_mm, 1.4 * fine.thinnest_part_mm);
  EXPECT_GT(coarse.half_transfer_mm, 1.4 * fine.half_transfer_mm);
  EXPECT_FALSE(coarse.too_coarse);
  EXPECT_FALSE(fine.too_coarse);
}

TEST(DenseOutlook, AtTheDepthThatTheFiguresWereTakenAt) {
  DecodeOptions at_two_metres;
  at_two_metres.depth_min_mm = 1600, at_two_metres.depth_max_mm = 2500;
  const Calibration rig = paper_rig();
  const DenseOutlook outlook = dense_outlook(pattern_of(8, 1), rig, 0, at_two_metres, 11);
  EXPECT_NEAR(outlook.depth_mm, 2000, 1);
  EXPECT_NEAR(outlook.half_transfer_mm, 7.8, 0.5);
  EXPECT_NEAR(outlook.thinnest_part_mm, 8, 1);
  EXPECT_NEAR(outlook.mm_per_px, 8.6, 0.2);  // a px of the projector
}

TEST(DenseOutlook, ACameraThatSeesMuchMoreThanTheProjectorShowsFindsItCoarse) {
  Calibration rig = paper_rig();
  for (double* of : {&rig.cameras[0].lens.fx, &rig.cameras[0].lens.fy}) *of *= 3;
  const Pattern pattern = pattern_of(16, 2);
  EXPECT_TRUE(dense_outlook(pattern, rig, 0, {}, DenseMapper(pattern, rig, 0, {}).window_px()).too_coarse);
}

TEST(WallFrame, IsDecodedAndMeasuredWhereItStands) {
  const Calibration rig = paper_rig();
  const Pattern pattern = pattern_of(16, 2);
  const Grey8 frame = wall_frame(pattern, rig, 0, 2000);
  Decoder decoder = Decoder::create(pattern, rig, 0, {}).value();
  ASSERT_TRUE(decoder.decode(frame.view(), 255));
  DenseMapper mapper(pattern, rig, 0, {});
  SerialExecutor executor;
  const DenseMap& map = mapper.measure(frame.view(), 255, decoder.symbols(), executor);
  EXPECT_GT(map.count(DensePixel::kMeasured), 500'000U);
  EXPECT_NEAR(map.depth_mm[static_cast<std::size_t>(600) * map.width + 800], 2000, 1);
}

TEST(DenseMapper, TwentyMegapixelsAreHeldToABound) {
  Lens camera = paper_rig().cameras[0].lens;
  camera.width_px = 5472, camera.height_px = 3648;
  EXPECT_EQ(DenseMapper::stride_px(camera, {}), 4);
  DenseOptions finest;
  finest.stride_px = 1;
  EXPECT_EQ(DenseMapper::stride_px(camera, finest), 4);
  EXPECT_EQ(DenseMapper::stride_px(paper_rig().cameras[0].lens, finest), 1);
}

}  // namespace
}  // namespace slsd
