// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/binarize.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "core/paper/binarize.hpp"
#include "core/regions/find_regions.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/images.hpp"

namespace slsd {
namespace {

Mask binarize(const GreyView& frame, const BinarizeOptions& options = {}, double full = 0) {
  Mask mask;
  Binarizer(options).binarize(frame, full > 0 ? full : frame.index() == 0 ? 255 : 65535, mask, alone);
  return mask;
}

int count_lit(const Mask& mask) {
  int lit = 0;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) lit += mask.at(x, y);
  }
  return lit;
}

// 12 px squares, a pitch of 18.
bool in_square(int x, int y) {
  return x % 18 < 12 && y % 18 < 12;
}

// Squares under light that falls to a tenth from left to right, with noise.
Grey8 uneven_light(int width, int height) {
  Grey8 frame(width, height);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double light = 240 * std::pow(0.1, static_cast<double>(x) / (width - 1));
      const double grey = (in_square(x, y) ? 1 : 0.1) * light + noise(random);
      frame.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
    }
  }
  return frame;
}

Grey8 noise_only(double mean, double sigma, std::uint32_t seed) {
  Grey8 frame(640, 480);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(mean, sigma);
  for (std::size_t i = 0; i < frame.size(); ++i)
    frame.data()[i] = static_cast<std::uint8_t>(std::clamp(std::lround(noise(random)), 0L, 255L));
  return frame;
}

int wrong_pixels(const Mask& mask) {
  int wrong = 0;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) wrong += mask.at(x, y) != in_square(x, y);
  }
  return wrong;
}

// The thresholds once more, pixel by pixel and in double precision.
class PlainThresholds {
 public:
  PlainThresholds(const Grey8& frame, const BinarizeOptions& options) : options_(options) {
    const int tile = options.tile_px;
    columns_ = (frame.width() + tile - 1) / tile, rows_ = (frame.height() + tile - 1) / tile;
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) midway_.push_back(midway(frame, row, column));
    }
  }

  [[nodiscard]] double at(int x, int y) const {
    // In bands of four rows, at the height of the third.
    const double v = std::clamp((y / 4 * 4 + 2.5) / options_.tile_px - 0.5, 0., rows_ - 1.);
    const double u = std::clamp(static_cast<double>(x - options_.tile_px / 2) / options_.tile_px, 0., columns_ - 1.);
    const int r = static_cast<int>(v), c = static_cast<int>(u);
    const double dv = v - r, du = u - c;
    return (1 - dv) * ((1 - du) * mean(r, c) + du * mean(r, c + 1)) +
           dv * ((1 - du) * mean(r + 1, c) + du * mean(r + 1, c + 1));
  }

 private:
  [[nodiscard]] double midway(const Grey8& frame, int row, int column) const {
    const int tile = options_.tile_px;
    int low = 255, high = 0;
    double saturated = 0;
    for (int r = std::max(row - 1, 0); r <= row + 1; ++r)
      for (int c = std::max(column - 1, 0); c <= column + 1; ++c) saturated += saturated_share(frame, r, c) / 9;
    for (int y = std::max((row - 1) * tile, 0); y < std::min((row + 2) * tile, frame.height()); ++y) {
      for (int x = std::max((column - 1) * tile, 0); x < std::min((column + 2) * tile, frame.width()); ++x) {
        low = std::min<int>(low, frame.at(x, y));
        high = std::max<int>(high, frame.at(x, y));
      }
    }
    if (high - low < options_.contrast_min) return high + options_.contrast_min;
    const double level = options_.level, rise = std::clamp((saturated - 0.05) / 0.15, 0., 1.);
    return low + (level + rise * (0.95 - level)) * (high - low);
  }
  [[nodiscard]] double saturated_share(const Grey8& frame, int row, int column) const {
    const int tile = options_.tile_px;
    double saturated = 0, all = 0;
    for (int y = row * tile; y < std::min((row + 1) * tile, frame.height()); ++y)
      for (int x = column * tile; x < std::min((column + 1) * tile, frame.width()); ++x)
        saturated += frame.at(x, y) == 255, ++all;
    return all > 0 ? saturated / all : 0;
  }
  [[nodiscard]] double mean(int row, int column) const {
    row = std::min(row, rows_ - 1), column = std::min(column, columns_ - 1);
    double sum = 0;
    int count = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c, ++count)
        sum += midway_[r * columns_ + c];
    }
    return sum / count;
  }

  BinarizeOptions options_;
  int columns_, rows_;
  std::vector<double> midway_;
};

RC_GTEST_PROP(Binarize, ComparesWithThePlainFormula, ()) {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  BinarizeOptions options;
  options.tile_px = 4 + static_cast<int>(random() % 20);
  options.level = 0.3F + 0.1F * static_cast<float>(random() % 3);
  options.contrast_min_sigma = 0;
  Grey8 frame(20 + static_cast<int>(random() % 90), 20 + static_cast<int>(random() % 60));
  // Steps of every height, flat stretches among them.
  int grey = 100;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (random() % 15 == 0) grey = random() % 3 == 0 ? 100 : std::min(255, static_cast<int>(random() % 320));
    frame.data()[i] = static_cast<std::uint8_t>(grey);
  }
  const Mask mask = binarize(frame.view(), options);
  const PlainThresholds plain(frame, options);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double above = frame.at(x, y) - plain.at(x, y);
      if (std::abs(above) > 0.01) RC_ASSERT(mask.at(x, y) == (above > 0));
    }
  }
}

TEST(Binarize, FollowsLightThatFallsToATenth) {
  const Grey8 frame = uneven_light(1008, 216);
  EXPECT_EQ(wrong_pixels(binarize(frame.view())), 0);
  // One threshold for all loses whole columns of squares.
  EXPECT_GT(wrong_pixels(binarize_paper(frame.view())), 20000);
}

TEST(Binarize, OfSixteenBitsIsThatOfEight) {
  const Grey8 frame = uneven_light(1008, 216);
  EXPECT_EQ(binarize(sixteen_bits(frame).view()), binarize(frame.view()));
}

TEST(Binarize, OfEveryDepthIsThatOfEight) {
  const Grey8 frame = uneven_light(1008, 216);
  for (const int times : {1, 4, 16, 64}) {
    EXPECT_EQ(binarize(deep(frame, 255.0 * times).view(), {}, 255.0 * times), binarize(frame.view())) << times;
  }
}

TEST(Binarize, FindsNothingInUniformFrames) {
  for (const int grey : {0, 1, 128, 255}) {
    const Grey8 frame(333, 251, static_cast<std::uint8_t>(grey));
    EXPECT_EQ(count_lit(binarize(frame.view())), 0) << grey;
    EXPECT_EQ(count_lit(binarize(sixteen_bits(frame).view())), 0) << grey;
  }
}

// Single pixels beyond the range that noise has nearly always; no region of a symbol's size.
TEST(Binarize, FindsHardlyAPixelInNoise) {
  std::uint32_t seed = 1;
  for (const double sigma : {0.5, 1., 2., 4., 8., 16.}) {
    const Grey8 frame = noise_only(120, sigma, seed++);
    EXPECT_LT(count_lit(binarize(frame.view())), 60) << sigma;
    EXPECT_LT(count_lit(binarize(sixteen_bits(frame).view())), 60) << sigma;
  }
}

TEST(Binarize, FindsFaintSquaresAboveTheNoise) {
  Grey8 frame = noise_only(40, 1, 9);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x)
      frame.at(x, y) = static_cast<std::uint8_t>(frame.at(x, y) + 12 * in_square(x, y));
  }
  EXPECT_LT(wrong_pixels(binarize(frame.view())), 30);
}

// Light is noisier than the dark: what noise most of a frame has says nothing of its dim parts.
TEST(Binarize, FindsDimSquaresBesideNoisyLight) {
  Grey8 frame(720, 432);
  std::mt19937 random(3);
  std::normal_distribution<double> gauss(0, 1);
  const auto is_dim = [&](int x) { return x >= 540; };
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double light = is_dim(x) ? 9 : 200, grey = (in_square(x, y) ? 1 : 0.2) * light + 2;
      frame.at(x, y) = static_cast<std::uint8_t>(std::lround(grey + std::sqrt(0.1 + 0.03 * grey) * gauss(random)));
    }
  }
  const Mask mask = binarize(frame.view());
  int wrong = 0;
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 600; x < frame.width(); ++x) wrong += mask.at(x, y) != in_square(x, y);
  EXPECT_LT(wrong, 100);
}

/// The blurred squares' light at a pixel, as a share of their middle's.
double blurred_square(double sigma_px, int x, int y) {
  const auto along = [&](int at) {
    double light = 0;
    for (int square = -1; square <= 1; ++square) {
      const double from = at % 18 - 18 * square + 0.5, to = from - 12;
      light +=
          0.5 * (std::erf(from / (sigma_px * std::numbers::sqrt2)) - std::erf(to / (sigma_px * std::numbers::sqrt2)));
    }
    return light;
  };
  return along(x) * along(y);
}

TEST(Binarize, KeepsTheSizeOfSaturatedSquares) {
  const auto lit_through = [](double white) {
    Grey8 frame(360, 180);
    for (int y = 0; y < frame.height(); ++y)
      for (int x = 0; x < frame.width(); ++x)
        frame.at(x, y) = static_cast<std::uint8_t>(std::min(255L, std::lround(10 + white * blurred_square(1.2, x, y))));
    return count_lit(binarize(frame.view())) / (20. * 10);
  };
  const double unclipped = lit_through(200);
  EXPECT_NEAR(unclipped, 12 * 12, 8);
  for (const double white : {350, 700}) EXPECT_NEAR(lit_through(white), unclipped, 0.3 * unclipped) << white;
}

TEST(Binarize, GlintLeavesTheSquaresAroundIt) {
  Grey8 frame(180, 180);
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) frame.at(x, y) = in_square(x, y) ? 180 : 20;
  for (int y = 90; y < 94; ++y)
    for (int x = 90; x < 94; ++x) frame.at(x, y) = 255;
  EXPECT_EQ(wrong_pixels(binarize(frame.view())), 0);
}

TEST(Binarize, ReadsFramesSmallerThanATile) {
  Grey8 frame(3, 2, 10);
  frame.at(1, 1) = 200;
  const Mask mask = binarize(frame.view());
  EXPECT_EQ(count_lit(mask), 1);
  EXPECT_TRUE(mask.at(1, 1));
}

TEST(Binarize, TakesAMaskOfAnotherSize) {
  Binarizer binarizer({});
  Mask mask(Grey8(5, 5, 255).view());
  binarizer.binarize(uneven_light(360, 90).view(), 255, mask, alone);
  EXPECT_EQ(mask.width(), 360);
  EXPECT_EQ(wrong_pixels(mask), 0);
  binarizer.binarize(Grey8(40, 30, 90).view(), 255, mask, alone);
  EXPECT_EQ(mask, Mask(40, 30));
}

}  // namespace
}  // namespace slsd
