// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/relief.hpp"

#include <string>

#include <gtest/gtest.h>

#include "picture/canvas.hpp"

namespace slsd {
namespace {

const Eigen::Vector3d kForward(0, 0, 1);
constexpr Rgb kPaper{255, 0, 255};  // no depth has this colour

ReliefVertex at(double x, double y, double depth, double share) {
  return {{x, y, depth}, -kForward, share};
}

// Gold, which is near, as 'n'; indigo, which is far, as 'f'; untouched as '.'; anything between as '?'.
std::string drawn(const Relief& relief, int width, int height) {
  ColourImage picture(width, height, kPaper);
  relief.compose(picture, 1e9);
  std::string art;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Rgb& pixel = picture.at(x, y);
      const bool gold = pixel[0] > pixel[2] + 40, indigo = pixel[2] > pixel[0] + 20;
      art += pixel == kPaper ? '.' : gold ? 'n' : indigo ? 'f' : '?';
    }
    art += '\n';
  }
  return art;
}

TEST(Relief, FillsATriangle) {
  Relief relief(6, 5, kForward);
  relief.triangle({at(0.5, 0.5, 5, 0), at(5.5, 0.5, 5, 0), at(0.5, 5.5, 5, 0)});
  EXPECT_EQ(drawn(relief, 6, 5).substr(7, 21),
            ".nnnnn\n"  // the last of each row is covered by three samples of four
            ".nnnn.\n"
            ".nnn..\n");
}

TEST(Relief, HidesWhatIsBehindInEitherOrder) {
  for (const bool near_first : {true, false}) {
    Relief relief(8, 5, kForward);
    const auto wall = [&] { relief.triangle({at(-20, -20, 9, 1), at(40, -20, 9, 1), at(-20, 40, 9, 1)}); };
    const auto disc = [&] { relief.disc(at(3.5, 2, 5, 0), 1.9); };
    if (near_first) disc();
    wall();
    if (!near_first) disc();
    const std::string art = drawn(relief, 8, 5);
    EXPECT_EQ(art.substr(9 * 2 + 2, 4), "nnnn") << art;
    EXPECT_EQ(art[0], 'f') << art;
    EXPECT_EQ(art[9 * 2 + 7], 'f') << art;
  }
}

TEST(Relief, SharesAnEdgeWithoutAGap) {
  Relief relief(12, 9, kForward);
  const ReliefVertex a = at(-1, -1, 5, 0), b = at(13, -1, 5, 0), c = at(14, 12, 5, 0), d = at(-2, 11, 5, 0);
  relief.triangle({a, b, c});
  relief.triangle({a, c, d});
  EXPECT_EQ(drawn(relief, 12, 9).find_first_not_of("n\n"), std::string::npos) << drawn(relief, 12, 9);
}

TEST(Relief, LightsWhatFacesTheLight) {
  const auto brightness = [](const Eigen::Vector3d& normal) {
    Relief relief(3, 3, kForward);
    relief.triangle({ReliefVertex{{-9, -9, 1}, normal, 0.5}, {{20, -9, 1}, normal, 0.5}, {{-9, 20, 1}, normal, 0.5}});
    ColourImage picture(3, 3);
    relief.compose(picture, 1e9);
    return picture.at(1, 1)[1];
  };
  const Eigen::Vector3d away(0.5, 0.8, -0.3);
  EXPECT_GT(brightness(light_direction()), brightness(-kForward));
  EXPECT_GT(brightness(-kForward), brightness(away));
  EXPECT_EQ(brightness(light_direction()), brightness(-light_direction()));
}

TEST(Relief, OutlinesAJumpInDepth) {
  ColourImage plain(9, 9), outlined(9, 9);
  Relief relief(9, 9, kForward);
  relief.triangle({at(-20, -20, 9, 1), at(40, -20, 9, 1), at(-20, 40, 9, 1)});
  relief.disc(at(4, 4, 1, 0), 3);
  relief.compose(plain, 100);
  relief.compose(outlined, 1);
  EXPECT_EQ(outlined.at(4, 4), plain.at(4, 4));
  EXPECT_LT(outlined.at(7, 4)[1], plain.at(7, 4)[1]);
}

TEST(Relief, CutsWhatLiesOutside) {
  Relief relief(4, 4, kForward);
  relief.triangle({at(1e9, 1e9, 1, 0), at(2e9, 1e9, 1, 0), at(1e9, 2e9, 1, 0)});
  relief.triangle({at(-1e9, -1e9, 1, 0), at(3e9, -1e9, 1, 0), at(-1e9, 3e9, 1, 0)});
  relief.disc(at(-50, 2, 0.5, 1), 3);
  EXPECT_EQ(drawn(relief, 4, 4), "nnnn\nnnnn\nnnnn\nnnnn\n");
}

}  // namespace
}  // namespace slsd
