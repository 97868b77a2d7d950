// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/symbol.hpp"

#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/code/ascii_picture.hpp"

namespace slsd {
namespace {

TEST(Symbol, NumbersAndNamesAreUnique) {
  std::set<std::string_view> names;
  for (int number = 1; number <= kSymbolCount; ++number) {
    EXPECT_EQ(symbol(number).number, number);
    EXPECT_FALSE(symbol(number).description.empty());
    names.insert(symbol(number).name);
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kSymbolCount));
}

TEST(DrawSymbol, DrawsThePapersSymbolsAtEightPixels) {
  EXPECT_EQ(ascii_picture(draw_symbol(5, 8)),
            "####....\n####....\n####....\n####....\n....####\n....####\n....####\n....####\n");
  EXPECT_EQ(ascii_picture(draw_symbol(7, 8)),
            "########\n########\n########\n########\n########\n########\n########\n########\n");
  EXPECT_EQ(ascii_picture(draw_symbol(22, 8)),
            "........\n........\n########\n########\n########\n########\n........\n........\n");
  EXPECT_EQ(ascii_picture(draw_symbol(25, 8)),
            "#.......\n##......\n###.....\n####....\n#####...\n######..\n#######.\n########\n");
}

TEST(DrawSymbol, DrawsTheTriangleOfEverySizeByTheSameRule) {
  for (const int size_px : kSymbolSizesPx) {
    const Grey8 image = draw_symbol(25, size_px);
    for (int y = 0; y < size_px; ++y)
      for (int x = 0; x < size_px; ++x) EXPECT_EQ(image.at(x, y) != 0, x <= y) << size_px << " " << x << " " << y;
  }
}

TEST(DrawSymbol, GivesEachSymbolItsOwnPicture) {
  for (const int size_px : kSymbolSizesPx) {
    std::set<std::string> pictures;
    for (int number = 1; number <= kSymbolCount; ++number) pictures.insert(ascii_picture(draw_symbol(number, size_px)));
    EXPECT_EQ(pictures.size(), static_cast<std::size_t>(kSymbolCount)) << size_px;
  }
}

// Lit pixels that can be reached from the first one through the eight neighbours.
int connected_pixels(Grey8 image) {
  std::vector<std::pair<int, int>> open;
  for (int i = 0; i < image.width() * image.height() && open.empty(); ++i)
    if (image.data()[i] != 0) open.emplace_back(i % image.width(), i / image.width());
  int reached = 0;
  while (!open.empty()) {
    const auto [x, y] = open.back();
    open.pop_back();
    if (!image.view().contains(x, y) || image.at(x, y) == 0) continue;
    image.at(x, y) = 0;
    ++reached;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) open.emplace_back(x + dx, y + dy);
  }
  return reached;
}

TEST(DrawSymbol, DrawsOneConnectedRegion) {
  for (const int size_px : kSymbolSizesPx) {
    for (int number = 1; number <= kSymbolCount; ++number) {
      const Grey8 image = draw_symbol(number, size_px);
      int lit = 0;
      for (std::size_t i = 0; i < image.size(); ++i) lit += image.data()[i];
      EXPECT_GT(lit, size_px * size_px / 8) << number << " at " << size_px;
      EXPECT_EQ(connected_pixels(image), lit) << number << " at " << size_px;
    }
  }
}

TEST(DrawSymbol, KeepsTheSymmetryOfItsRule) {
  for (const int size_px : kSymbolSizesPx) {
    for (const int number : {1, 2, 3, 4, 6, 7, 8, 9, 12, 13, 15, 17, 22, 23}) {
      const Grey8 image = draw_symbol(number, size_px);
      for (int y = 0; y < size_px; ++y)
        for (int x = 0; x < size_px; ++x)
          EXPECT_EQ(image.at(x, y), image.at(size_px - 1 - x, y)) << number << " at " << size_px;
    }
  }
}

TEST(DrawSymbol, KeepsHolesOpenFromTenPixelsUp) {
  for (const int size_px : {10, 12, 14, 16}) {
    for (const int number : {2, 3}) {
      const Grey8 image = draw_symbol(number, size_px);
      EXPECT_EQ(image.at(size_px / 2, size_px / 2), 0) << number << " at " << size_px;
      EXPECT_EQ(image.at(size_px / 2 - 1, size_px / 2 - 1), 0) << number << " at " << size_px;
    }
  }
}

}  // namespace
}  // namespace slsd
