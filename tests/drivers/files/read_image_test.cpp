// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/read_image.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <tuple>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/drivers/jpeg_bytes.hpp"
#include "tests/drivers/plain_images.hpp"
#include "tests/drivers/temporary_folder.hpp"

namespace slsd {
namespace {

using test::ramp16;
using test::ramp8;
using test::Samples;
using test::samples_of;
using ::testing::HasSubstr;

template <class T>
Image<T> random_image() {
  const int width = *rc::gen::inRange(1, 40), height = *rc::gen::inRange(1, 40);
  Image<T> image(width, height);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = *rc::gen::arbitrary<T>();
  return image;
}

RC_GTEST_PROP(DecodeImage, ReadsGreyOfEveryFormat8, ()) {
  const Grey8 image = random_image<std::uint8_t>();
  const Samples samples = samples_of(image);
  for (const std::string& file :
       {test::pnm_bytes(samples), test::plain_pnm_bytes(samples), test::png_bytes(samples),
        test::png_bytes(samples, true), test::tiff_bytes(samples, false), test::tiff_bytes(samples, true)})
    RC_ASSERT(decode_image(file, "file") == GreyImage(image));
}

RC_GTEST_PROP(DecodeImage, ReadsGreyOfEveryFormat16, ()) {
  const Grey16 image = random_image<std::uint16_t>();
  const Samples samples = samples_of(image);
  for (const std::string& file : {test::pnm_bytes(samples), test::plain_pnm_bytes(samples), test::png_bytes(samples),
                                  test::tiff_bytes(samples, false), test::tiff_bytes(samples, true)})
    RC_ASSERT(decode_image(file, "file") == GreyImage(image));
}

ColourImage colours() {
  ColourImage image(17, 11);
  for (std::size_t i = 0; i < image.size(); ++i)
    image.data()[i] = {static_cast<std::uint8_t>(31 * i), static_cast<std::uint8_t>(255 - 3 * i),
                       static_cast<std::uint8_t>(101 * i + 7)};
  return image;
}

/// What OpenCV makes of the colours.
Grey8 grey_of(const ColourImage& image) {
  Grey8 grey(image.width(), image.height());
  cv::Mat out(image.height(), image.width(), CV_8UC1, grey.data());
  const cv::Mat in(image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data()));
  cv::cvtColor(in, out, cv::COLOR_RGB2GRAY);
  return grey;
}

TEST(DecodeImage, TurnsColourOfEveryFormatIntoGreyAsOpenCvDoes) {
  const Samples samples = samples_of(colours());
  const GreyImage expected = grey_of(colours());
  for (const std::string& file : {test::pnm_bytes(samples), test::plain_pnm_bytes(samples), test::png_bytes(samples),
                                  test::tiff_bytes(samples, false), test::tiff_bytes(samples, true)})
    EXPECT_EQ(decode_image(file, "file"), expected);
}

TEST(DecodeImage, WeighsPureColoursByBt601) {
  ColourImage image(3, 1);
  image.at(0, 0) = {255, 0, 0};
  image.at(1, 0) = {0, 255, 0};
  image.at(2, 0) = {0, 0, 255};
  Grey8 grey(3, 1);
  std::tie(grey.at(0, 0), grey.at(1, 0), grey.at(2, 0)) = std::tuple(76, 150, 29);
  EXPECT_EQ(decode_image(test::png_bytes(samples_of(image)), "file"), GreyImage(grey));
}

TEST(DecodeImage, TurnsDeepColourIntoDeepGrey) {
  const Samples samples{2, 1, 3, 16, {65535, 65535, 65535, 1000, 2000, 3000}};
  Grey16 grey(2, 1);
  grey.at(0, 0) = 65535;
  grey.at(1, 0) = 1815;  // 0.299 * 1000 + 0.587 * 2000 + 0.114 * 3000
  for (const std::string& file : {test::pnm_bytes(samples), test::png_bytes(samples), test::tiff_bytes(samples, true)})
    EXPECT_EQ(decode_image(file, "file"), GreyImage(grey));
}

/// Levels of an image's colours.
ColourFrame levels_of(const ColourImage& image) {
  ColourFrame levels(image.width(), image.height());
  for (std::size_t i = 0; i < image.size(); ++i) std::ranges::copy(image.data()[i], levels.data()[i].begin());
  return levels;
}

TEST(ReadColours, GivesThoseOfEveryFormat) {
  const test::TemporaryFolder folder;
  const Samples samples = samples_of(colours()), deep{2, 1, 3, 16, {65535, 65535, 65535, 1000, 2000, 3000}};
  for (const std::string& file : {test::pnm_bytes(samples), test::plain_pnm_bytes(samples), test::png_bytes(samples),
                                  test::tiff_bytes(samples, false), test::tiff_bytes(samples, true)})
    EXPECT_EQ(read_colours(folder.write("colours", file)), levels_of(colours()));
  for (const std::string& file : {test::pnm_bytes(deep), test::png_bytes(deep), test::tiff_bytes(deep, true)})
    EXPECT_EQ(read_colours(folder.write("deep", file))->at(1, 0), (ColourLevels{1000, 2000, 3000}));
}

TEST(ReadColours, GivesThoseOfAJpeg) {
  const test::TemporaryFolder folder;
  const std::string jpeg = test::jpeg_bytes(Grey8(64, 48, 200), {.shares = {255, 128, 64}});
  const auto read = read_colours(folder.write("colours.jpg", jpeg));
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->size(), 64u * 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      EXPECT_NEAR(read->at(x, y)[0], 200, 3);
      EXPECT_NEAR(read->at(x, y)[1], 100, 3);
      EXPECT_NEAR(read->at(x, y)[2], 50, 3);
    }
}

TEST(ReadColours, GivesNoneOfAGreyImage) {
  const test::TemporaryFolder folder;
  const Samples samples = samples_of(ramp8(12, 8, 10));
  EXPECT_TRUE(read_colours(folder.write("grey.png", test::png_bytes(samples)))->empty());
  EXPECT_FALSE(read_colours(folder.write("none.png", "")).has_value());
}

TEST(DecodeImage, IgnoresTransparency) {
  const Samples grey_alpha{2, 1, 2, 8, {200, 0, 17, 255}};
  const Samples rgb_alpha{2, 1, 4, 8, {200, 200, 200, 0, 17, 17, 17, 128}};
  Grey8 grey(2, 1);
  grey.at(0, 0) = 200;
  grey.at(1, 0) = 17;
  EXPECT_EQ(decode_image(test::png_bytes(grey_alpha), "file"), GreyImage(grey));
  EXPECT_EQ(decode_image(test::png_bytes(rgb_alpha), "file"), GreyImage(grey));
  EXPECT_EQ(decode_image(test::tiff_bytes(rgb_alpha, false), "file"), GreyImage(grey));
  EXPECT_EQ(decode_image(test::tiff_bytes(grey_alpha, true), "file"), GreyImage(grey));
}

TEST(DecodeImage, LooksUpPalettes) {
  Grey8 indices(2, 1), grey(2, 1);
  indices.at(1, 0) = 1;
  grey.at(0, 0) = 255;
  grey.at(1, 0) = 29;
  EXPECT_EQ(decode_image(test::palette_png_bytes(indices, {{255, 255, 255}, {0, 0, 255}}), "file"), GreyImage(grey));
}

TEST(DecodeImage, SpreadsFewBitsOverAByte) {
  const auto read = [](int bits, std::uint16_t value) {
    const auto image = decode_image(test::png_bytes({3, 1, 1, bits, {0, value, 0}}), "file");
    return image ? std::get<Grey8>(*image).at(1, 0) : -1;
  };
  EXPECT_EQ(read(1, 1), 255);
  EXPECT_EQ(read(2, 1), 85);
  EXPECT_EQ(read(4, 3), 51);
}

TEST(DecodeImage, KeepsTheValuesOfTenBits) {
  const Samples samples{2, 1, 1, 16, {1023, 5}};
  Grey16 image(2, 1);
  image.at(0, 0) = 1023;
  image.at(1, 0) = 5;
  for (const std::string& file : {test::png_bytes(samples), test::tiff_bytes(samples, true), test::pnm_bytes(samples)})
    EXPECT_EQ(decode_image(file, "file"), GreyImage(image));
}

TEST(DecodeImage, TurnsMosaicsIntoGreyButNotColours) {
  const Grey8 mosaic = ramp8(12, 10);
  const ReadImageOptions bayer{.bayer = BayerPattern::kRggb};
  EXPECT_EQ(decode_image(test::png_bytes(samples_of(mosaic)), "file", bayer), GreyImage(grey_from_mosaic(mosaic)));
  const Grey16 deep = ramp16(12, 10);
  EXPECT_EQ(decode_image(test::png_bytes(samples_of(deep)), "file", bayer), GreyImage(grey_from_mosaic(deep)));
  EXPECT_EQ(decode_image(test::png_bytes(samples_of(colours())), "file", bayer), GreyImage(grey_of(colours())));
}

TEST(DecodeImage, RefusesAMosaicWithoutNeighbours) {
  const auto refused = decode_image(test::png_bytes(samples_of(ramp8(5, 1))), "file", {.bayer = BayerPattern::kGbrg});
  EXPECT_EQ(refused.error().code, ErrorCode::kMismatch);
}

TEST(ReadImage, NamesTheFileAndTheRemedy) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("frame.png", "GIF89a");
  const auto refused = read_image(path);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(refused.error().where, path.string());
  EXPECT_THAT(refused.error().message, HasSubstr("convert it"));
}

TEST(ReadImage, NamesWhatIsWrongWithThePath) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(read_image(folder.path() / "none.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_image(folder.path()).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_image(folder.write("empty.png", "")).error().code, ErrorCode::kMalformed);
}

TEST(ReadImage, ReadsWhateverTheNameEndsOn) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(read_image(folder.write("frame.data", test::png_bytes(samples_of(ramp8(4, 3))))), GreyImage(ramp8(4, 3)));
}

}  // namespace
}  // namespace slsd
