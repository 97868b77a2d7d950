// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <gtest/gtest.h>

#include "core/decode/decoder.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

using test::decode;
using test::decoder_of;

const PixelRectangle kPart{700, 500, 980, 690};

/// The points of pixels, by their cells.
std::map<std::pair<int, int>, CloudPoint> points_in(const Decoding& decoding, const PixelRectangle& pixels) {
  std::map<std::pair<int, int>, CloudPoint> points;
  for (const CloudPoint& point : decoding.points) {
    if (pixels.contains(static_cast<int>(point.camera_u), static_cast<int>(point.camera_v)))
      points[{point.column, point.row}] = point;
  }
  return points;
}

class DecodePart : public testing::Test {
 protected:
  const Pattern pattern = shipped_pattern("8px-6.toml");
  const Grey8 frame = test::frame_of(pattern, test::kCylinder);
  Decoder decoder = decoder_of(pattern);

  Decoding of_part(const std::optional<PixelRectangle>& part) {
    decoder.set_part(part);
    return decode(decoder, frame.view());
  }
};

/// The look of symbols is measured from those of the part, so that some centres move by a part of their sigma.
TEST_F(DecodePart, HasThePointsOfTheWholeFrame) {
  const Decoding whole = of_part(std::nullopt);
  for (const PixelRectangle& part : {kPart, PixelRectangle{0, 400, 1600, 520}, PixelRectangle{0, 0, 1600, 1200}}) {
    const auto mine = points_in(of_part(part), part), theirs = points_in(whole, part);
    EXPECT_GT(theirs.size(), 100U);
    std::size_t missing = 0, moved = 0;
    for (const auto& [cell, point] : theirs) {
      missing += !mine.contains(cell);
      if (!mine.contains(cell)) continue;
      const float off = std::abs(mine.at(cell).z - point.z) / point.sigma_mm;
      EXPECT_LT(off, 3);
      moved += off > 0.5F;
    }
    EXPECT_LE(moved, theirs.size() / 50);
    EXPECT_LE(missing, theirs.size() / 100);
    EXPECT_LE(mine.size() + missing, theirs.size() + theirs.size() / 100);
  }
}

TEST_F(DecodePart, HasNoRegionFarAway) {
  const Decoding part = of_part(kPart);
  const PixelRectangle around = kPart.widened(120, paper_rig().cameras[0].lens);
  EXPECT_TRUE(std::ranges::all_of(part.regions, [&](const RegionSeen& region) {
    return around.contains(static_cast<int>(region.centre_px.x()), static_cast<int>(region.centre_px.y()));
  }));
  EXPECT_LT(part.regions.size(), of_part(std::nullopt).regions.size() / 3);
}

TEST_F(DecodePart, WithoutPixelsHasNoRegion) {
  EXPECT_TRUE(of_part(PixelRectangle{}).regions.empty());
  EXPECT_TRUE(decode(decoder, frame.view()).points.empty());
}

TEST_F(DecodePart, LeavesNothingBehind) {
  const Decoding before = of_part(std::nullopt);
  (void)of_part(kPart);
  const Decoding after = of_part(std::nullopt);
  EXPECT_EQ(before.counts, after.counts);
  EXPECT_EQ(before.points.size(), after.points.size());
}

}  // namespace
}  // namespace slsd
