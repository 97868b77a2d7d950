// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/draw_decoding.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace slsd {
namespace {

constexpr int kPitchPx = 24;  // so wide that the picture is not enlarged

// Regions in rows of art, kPitchPx apart: a letter is decoded, '+' is not; '-' and '|' between them are links, '~' and
// '!' broken ones.
struct Scene {
  Grey8 frame;
  Decoding decoding;
  Pattern pattern;
};

RegionSeen region_of(char mark, int column, int row) {
  RegionSeen region{};
  region.centre_px = {static_cast<float>(kPitchPx * (column + 1)), static_cast<float>(kPitchPx * (row + 1))};
  region.status = mark == '+' ? RegionStatus::kNoCodeword : RegionStatus::kDecoded;
  region.letter = static_cast<std::int8_t>(mark == '+' ? -1 : mark - 'a');
  region.links = {-1, -1, -1, -1};
  return region;
}

void join(Scene& scene, int from, Direction direction, int to, bool broken) {
  const auto back = static_cast<std::size_t>(direction == kRight ? kLeft : kUp);
  scene.decoding.regions[from].links[direction] = to;
  scene.decoding.regions[from].broken[direction] = broken;
  scene.decoding.regions[to].links[back] = from;
  scene.decoding.regions[to].broken[back] = broken;
}

Scene scene_of(const std::vector<std::string>& art) {
  Scene scene{Grey8(240, 160, 100), {}, {}};
  scene.pattern.options.symbols = {5, 7, 22};
  std::vector<std::vector<int>> at(art.size(), std::vector<int>(art[0].size(), -1));
  for (std::size_t y = 0; y < art.size(); y += 2) {
    for (std::size_t x = 0; x < art[y].size(); x += 2) {
      if (art[y][x] == ' ') continue;
      at[y][x] = static_cast<int>(scene.decoding.regions.size());
      scene.decoding.regions.push_back(region_of(art[y][x], static_cast<int>(x / 2), static_cast<int>(y / 2)));
      ++scene.decoding.counts[static_cast<std::size_t>(scene.decoding.regions.back().status)];
    }
  }
  for (std::size_t y = 0; y < art.size(); ++y) {
    for (std::size_t x = 0; x < art[y].size(); ++x) {
      if (art[y][x] == '-' || art[y][x] == '~') join(scene, at[y][x - 1], kRight, at[y][x + 1], art[y][x] == '~');
      if (art[y][x] == '|' || art[y][x] == '!') join(scene, at[y - 1][x], kDown, at[y + 1][x], art[y][x] == '!');
    }
  }
  return scene;
}

// Thin lines are mixed with what is behind them.
bool close(const Rgb& a, const Rgb& b) {
  int most = 0;
  for (std::size_t i = 0; i < 3; ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most < 30;
}

bool has(const ColourImage& picture, int x, int y, Rgb colour) {
  for (int dy = -3; dy <= 3; ++dy) {
    for (int dx = -3; dx <= 3; ++dx) {
      if (close(picture.at(x + dx, y + dy), colour)) return true;
    }
  }
  return false;
}

char mark_at(const ColourImage& picture, int x, int y, bool between) {
  for (int letter = 0; letter < 3; ++letter) {
    if (has(picture, x, y, letter_colour(letter))) return static_cast<char>('a' + letter);
  }
  if (!between && has(picture, x, y, kUndecodedColour)) return '+';
  if (has(picture, x, y, kBrokenLinkColour)) return '~';
  if (has(picture, x, y, kLinkColour)) return '-';
  return ' ';
}

// The picture read back: what stands on each region's place and half way between.
std::vector<std::string> art_of(const ColourImage& picture, std::size_t rows, std::size_t columns) {
  std::vector<std::string> art(rows, std::string(columns, ' '));
  for (std::size_t y = 0; y < rows; ++y) {
    for (std::size_t x = 0; x < columns; ++x) {
      const int px = kPitchPx + static_cast<int>(x) * kPitchPx / 2, py = kPitchPx + static_cast<int>(y) * kPitchPx / 2;
      char mark = mark_at(picture, px, py, x % 2 == 1 || y % 2 == 1);
      if (y % 2 == 1) mark = mark == '-' ? '|' : mark == '~' ? '!' : mark;
      art[y][x] = mark;
    }
  }
  return art;
}

TEST(DrawDecoding, MarksRegionsAndLinks) {
  const std::vector<std::string> art{"a-b c-a",  //
                                     "| |   !",  //
                                     "c-a-+ b",  //
                                     "  !   |",  //
                                     "+ c~b a"};
  const Scene scene = scene_of(art);
  EXPECT_EQ(art_of(draw_decoding(scene.frame.view(), scene.decoding, scene.pattern), art.size(), art[0].size()), art);
}

TEST(DrawDecoding, DrawsSixteenBitsLikeEight) {
  const Scene scene = scene_of({"a-b"});
  Grey8 eight(240, 160);
  Grey16 sixteen(240, 160);
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 240; ++x) {
      eight.at(x, y) = static_cast<std::uint8_t>(x / 2);
      sixteen.at(x, y) = static_cast<std::uint16_t>(x / 2 * 16);
    }
  }
  EXPECT_EQ(draw_decoding(eight.view(), scene.decoding, scene.pattern),
            draw_decoding(sixteen.view(), scene.decoding, scene.pattern));
}

TEST(DrawDecoding, EnlargesSmallSymbols) {
  Scene scene = scene_of({"a-b"});
  scene.decoding.regions[1].centre_px.x() = scene.decoding.regions[0].centre_px.x() + 8;
  const ColourImage picture = draw_decoding(scene.frame.view(), scene.decoding, scene.pattern);
  EXPECT_EQ(picture.width(), 3 * 240);
  EXPECT_TRUE(has(picture, 3 * kPitchPx, 3 * kPitchPx, letter_colour(0)));
}

TEST(DrawDecoding, StandsRegionsOutsideTheFrameAndNone) {
  Scene scene = scene_of({"a-b"});
  scene.decoding.regions[1].centre_px = {5000.0F, -5000.0F};
  EXPECT_FALSE(draw_decoding(scene.frame.view(), scene.decoding, scene.pattern).empty());
  EXPECT_FALSE(draw_decoding(scene.frame.view(), {}, {}).empty());
}

TEST(DrawDecoding, ShowsReasonsInTheColoursOfTheirRules) {
  Scene scene = scene_of({"a-+ + b"});
  scene.decoding.regions[1].rule = DecodeRule::kSplit, scene.decoding.regions[2].rule = DecodeRule::kUncertain;
  for (const DecodeRule rule : {DecodeRule::kSplit, DecodeRule::kUncertain})
    scene.decoding.rules[static_cast<std::size_t>(rule)] = 1;
  const ColourImage picture = draw_decoding(scene.frame.view(), scene.decoding, scene.pattern, DecodingLook::kReasons);
  EXPECT_TRUE(has(picture, 2 * kPitchPx, kPitchPx, rule_colour(DecodeRule::kSplit)));
  EXPECT_FALSE(has(picture, 2 * kPitchPx, kPitchPx, rule_colour(DecodeRule::kUncertain)));
  EXPECT_TRUE(has(picture, 3 * kPitchPx, kPitchPx, rule_colour(DecodeRule::kUncertain)));
  EXPECT_FALSE(has(picture, kPitchPx, kPitchPx, letter_colour(0))) << "letters would hide what is asked for";
  EXPECT_FALSE(has(picture, 3 * kPitchPx / 2, kPitchPx, kLinkColour));
  scene.decoding.rules = {};
  const ColourImage few = draw_decoding(scene.frame.view(), scene.decoding, scene.pattern, DecodingLook::kReasons);
  EXPECT_GT(picture.height(), few.height()) << "the legend has a place for each rule";
}

TEST(DrawDecoding, TellsRulesApartThatAreNearInTheList) {
  for (std::size_t i = 1; i < kDecodeRuleCount; ++i)
    EXPECT_FALSE(close(rule_colour(decode_rule(i)), rule_colour(decode_rule(i - 1)))) << i;
}

TEST(DrawDecoding, DimsTheFrame) {
  const Grey8 white(64, 48, 255);
  const ColourImage picture = draw_decoding(white.view(), {}, {});
  EXPECT_LT(picture.at(5, 5)[0], 160);
  EXPECT_GT(picture.at(5, 5)[0], 60);
}

}  // namespace
}  // namespace slsd
