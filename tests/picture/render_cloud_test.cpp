// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/render_cloud.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "picture/depth_colour.hpp"
#include "tests/picture/lattice_cloud.hpp"

namespace slsd {
namespace {

constexpr CloudPictureSize kSmall{400, 300};

// Pixels of the drawing (not its colour bar) that are strongly coloured.
int coloured(const ColourImage& picture) {
  int count = 0;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width() * 3 / 4; ++x) {
      const auto [low, high] = std::minmax_element(picture.at(x, y).begin(), picture.at(x, y).end());
      count += *high - *low > 50 ? 1 : 0;
    }
  }
  return count;
}

TEST(RenderCloud, DrawsTheSurfaceLarge) {
  const ColourImage picture = render_cloud(lattice_cloud(40, 30, [](int, int) { return 1000; }), kSmall);
  EXPECT_EQ(picture.width(), 400);
  EXPECT_EQ(picture.height(), 300);
  EXPECT_GT(coloured(picture), 400 * 300 / 6);
}

TEST(RenderCloud, ColoursNearAndFar) {
  const auto ball = [](int column, int row) { return std::hypot(column - 20, row - 15) < 6 ? 800 : 1000; };
  const ColourImage picture = render_cloud(lattice_cloud(40, 30, ball), kSmall);
  int warm = 0, cold = 0;
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < 300; ++x) {
      const Rgb& pixel = picture.at(x, y);
      warm += pixel[0] > pixel[2] + 60 ? 1 : 0;
      cold += pixel[2] > pixel[0] + 40 ? 1 : 0;
    }
  }
  EXPECT_GT(warm, 300);
  EXPECT_GT(cold, 5000);
}

TEST(RenderCloud, DrawsTheRoomOfAnEmptyCloud) {
  const ColourImage picture = render_cloud({}, kSmall);
  EXPECT_EQ(picture.width(), 400);
  EXPECT_EQ(coloured(picture), 0);
}

TEST(RenderCloud, NamesThePointsThatWereMeasured) {
  const Cloud cloud = lattice_cloud(6, 5, [](int, int) { return 1000; });
  EXPECT_EQ(render_cloud(cloud, kSmall, 30), render_cloud(cloud, kSmall));
  EXPECT_FALSE(render_cloud(cloud, kSmall, 1739383) == render_cloud(cloud, kSmall));
}

TEST(RenderCloud, LeavesOutWhatIsNotFinite) {
  Cloud cloud = lattice_cloud(40, 30, [](int, int) { return 1000; });
  const ColourImage clean = render_cloud(cloud, kSmall);
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e30F}) {
    cloud.points.push_back({.x = value, .y = 1, .z = 1000});
    cloud.points.push_back({.x = 1, .y = 1, .z = value});
  }
  EXPECT_EQ(render_cloud(cloud, kSmall), clean);
}

TEST(DepthColour, DarkensSteadily) {
  double last = 1e9;
  for (int i = 0; i <= 20; ++i) {
    const Rgb colour = depth_colour(i / 20.0);
    const double lightness = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
    EXPECT_LT(lightness, last);
    last = lightness;
  }
  EXPECT_EQ(depth_colour(-3), depth_colour(0));
  EXPECT_EQ(depth_colour(7), depth_colour(1));
}

}  // namespace
}  // namespace slsd
