// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/bayer.hpp"

#include <cmath>
#include <cstdlib>
#include <random>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

struct Centre {
  double x = 0.0;
  double y = 0.0;
};

/// The colour, 0 red, 1 green, 2 blue, of a pixel of an RGGB mosaic.
int colour_at(int x, int y) {
  return (x & 1) + (y & 1);
}

/// A round spot of sigma 2 px on grey ground, seen by a camera whose channels differ in gain.
Grey8 spot(double x0, double y0, const std::array<double, 3>& gains) {
  Grey8 mosaic(32, 32);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      const double light = 20.0 + 150.0 * std::exp(-(std::pow(x - x0, 2) + std::pow(y - y0, 2)) / 8.0);
      mosaic.at(x, y) = static_cast<std::uint8_t>(std::lround(light * gains[colour_at(x, y)]));
    }
  return mosaic;
}

/// The centroid of what stands out from the ground around it.
Centre centroid(const Grey8& image) {
  double sum = 0.0, ground = 255.0;
  Centre centre;
  for (std::size_t i = 0; i < image.size(); ++i) ground = std::min<double>(ground, image.data()[i]);
  for (int y = 6; y < 26; ++y)
    for (int x = 6; x < 26; ++x) {
      const double weight = std::max(0.0, image.at(x, y) - ground - 8.0);
      sum += weight;
      centre.x += weight * x;
      centre.y += weight * y;
    }
  return {centre.x / sum, centre.y / sum};
}

Grey8 grey_by_interpolation(const Grey8& mosaic) {
  Grey8 grey(mosaic.width(), mosaic.height());
  const cv::Mat in(mosaic.height(), mosaic.width(), CV_8UC1, const_cast<std::uint8_t*>(mosaic.data()));
  cv::Mat out(mosaic.height(), mosaic.width(), CV_8UC1, grey.data());
  cv::cvtColor(in, out, cv::COLOR_BayerRGGB2GRAY);
  return grey;
}

template <class Method>
double centre_error_px(const Method& method) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(14.0, 18.0);
  double squares = 0.0;
  constexpr int kSpots = 400;
  for (int i = 0; i < kSpots; ++i) {
    const double x = place(random), y = place(random);
    const Centre found = centroid(method(spot(x, y, {0.6, 1.0, 0.5})));
    squares += std::pow(found.x - x, 2) + std::pow(found.y - y, 2);
  }
  return std::sqrt(squares / (2 * kSpots));
}

TEST(GreyFromMosaic, LeavesNoMosaicOfAnEvenColour) {
  for (const std::array<int, 3> colour : {std::array{200, 40, 12}, std::array{8, 100, 240}}) {
    Grey8 mosaic(9, 8);
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 9; ++x) mosaic.at(x, y) = static_cast<std::uint8_t>(colour[colour_at(x, y)]);
    const auto expected = static_cast<std::uint8_t>((colour[0] + 2 * colour[1] + colour[2] + 2) / 4);
    EXPECT_EQ(grey_from_mosaic(mosaic), Grey8(9, 8, expected));
  }
}

TEST(GreyFromMosaic, FindsCentresBetterThanInterpolationOfColours) {
  const double ours = centre_error_px([](const Grey8& mosaic) { return grey_from_mosaic(mosaic); });
  const double interpolated = centre_error_px(grey_by_interpolation);
  RecordProperty("centre_error_px", std::to_string(ours));
  RecordProperty("centre_error_of_interpolation_px", std::to_string(interpolated));
  EXPECT_LT(ours, 0.02);
  EXPECT_LT(ours, interpolated);
}

RC_GTEST_PROP(GreyFromMosaic, EqualsThePlainConvolution, ()) {
  const int width = *rc::gen::inRange(2, 20), height = *rc::gen::inRange(2, 20);
  Grey16 mosaic(width, height), plain(width, height);
  for (std::size_t i = 0; i < mosaic.size(); ++i) mosaic.data()[i] = *rc::gen::arbitrary<std::uint16_t>();
  const auto at = [&](int x, int y) {
    x = x < 0 ? 1 : x == width ? width - 2 : x;
    y = y < 0 ? 1 : y == height ? height - 2 : y;
    return static_cast<double>(mosaic.at(x, y));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double sum = 0.0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) sum += (2 - std::abs(dx)) * (2 - std::abs(dy)) * at(x + dx, y + dy);
      plain.at(x, y) = static_cast<std::uint16_t>(std::floor(sum / 16.0 + 0.5));
    }
  RC_ASSERT(grey_from_mosaic(mosaic) == plain);
}

/// An even colour, as each pattern sees it.
Grey16 even_mosaic(BayerPattern pattern, const ColourLevels& colour) {
  Grey16 mosaic(9, 8);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 9; ++x)
      mosaic.at(x, y) = colour[std::string_view("RGB").find(to_string(pattern)[2 * (y % 2) + x % 2])];
  return mosaic;
}

TEST(ColoursFromMosaic, AreEvenUpToTheEdgeInEveryPattern) {
  const ColourLevels colour{4000, 900, 17};
  for (const auto pattern : {BayerPattern::kRggb, BayerPattern::kBggr, BayerPattern::kGrbg, BayerPattern::kGbrg})
    EXPECT_EQ(colours_from_mosaic(even_mosaic(pattern, colour).view(), pattern), ColourFrame(9, 8, colour));
}

RC_GTEST_PROP(ColoursFromMosaic, HaveTheGreyAsTheirMean, ()) {
  const int width = *rc::gen::inRange(2, 20), height = *rc::gen::inRange(2, 20);
  Grey16 mosaic(width, height);
  for (std::size_t i = 0; i < mosaic.size(); ++i) mosaic.data()[i] = *rc::gen::arbitrary<std::uint16_t>();
  const Grey16 grey = grey_from_mosaic(mosaic);
  const ColourFrame colours = colours_from_mosaic(mosaic.view(), BayerPattern::kGrbg);
  for (std::size_t i = 0; i < mosaic.size(); ++i) {
    const auto& [red, green, blue] = colours.data()[i];
    RC_ASSERT(std::abs((red + 2.0 * green + blue) / 4 - grey.data()[i]) <= 1);
  }
}

TEST(ColoursFromMosaic, ResembleThoseOfOpenCv) {
  Grey8 mosaic(64, 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      mosaic.at(x, y) = static_cast<std::uint8_t>(std::array{40 + 3 * x, 100 + y, 220 - 2 * x}[colour_at(x, y)]);
  const ColourFrame colours = colours_from_mosaic(mosaic.view(), BayerPattern::kRggb);
  cv::Mat expected;
  cv::cvtColor(cv::Mat(48, 64, CV_8UC1, mosaic.data()), expected, cv::COLOR_BayerRGGB2RGB);
  for (int y = 1; y < 47; ++y)
    for (int x = 1; x < 63; ++x)
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(colours.at(x, y)[i], expected.at<cv::Vec3b>(y, x)[i], 2);
}

TEST(ParseBayerPattern, ReadsWhatToStringWrites) {
  for (const auto pattern :
       {BayerPattern::kNone, BayerPattern::kRggb, BayerPattern::kBggr, BayerPattern::kGrbg, BayerPattern::kGbrg})
    EXPECT_EQ(parse_bayer_pattern(to_string(pattern)), pattern);
  EXPECT_FALSE(parse_bayer_pattern("rgb"));
  EXPECT_FALSE(parse_bayer_pattern(""));
}

}  // namespace
}  // namespace slsd
