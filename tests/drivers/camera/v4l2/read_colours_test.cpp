// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/read_colours.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/files/bayer.hpp"
#include "tests/drivers/jpeg_bytes.hpp"

namespace slsd {
namespace {

FrameLayout layout_of(const char* fourcc, int width_px, int height_px, std::size_t stride_bytes) {
  FrameLayout layout;
  layout.mode = {*find_pixel_format(fourcc_from(fourcc)), width_px, height_px};
  layout.stride_bytes = stride_bytes;
  return layout;
}

std::span<const std::byte> bytes_of(const auto& data) {
  return std::as_bytes(std::span(data));
}

/// Y, Cb and Cr of a colour by ITU-R BT.601 with the limited range, in the direction opposite to the converter's.
std::array<std::uint8_t, 3> ycc(const std::array<double, 3>& rgb) {
  const auto level = [](double value) { return static_cast<std::uint8_t>(std::lround(value)); };
  const auto& [r, g, b] = rgb;
  return {level(16 + (65.481 * r + 128.553 * g + 24.966 * b) / 255),
          level(128 + (-37.797 * r - 74.203 * g + 112.0 * b) / 255),
          level(128 + (112.0 * r - 93.786 * g - 18.214 * b) / 255)};
}

TEST(ColoursLater, ConvertsChromaInEitherOrder) {
  for (const auto& rgb : {std::array{255.0, 255.0, 255.0}, {0.0, 0.0, 0.0}, {200.0, 30.0, 60.0}, {10.0, 220.0, 90.0}}) {
    const auto [y, cb, cr] = ycc(rgb);
    for (const auto& [fourcc, four] : {std::pair("YUYV", std::array{y, cb, y, cr}), {"UYVY", {cb, y, cr, y}}}) {
      std::vector<std::uint8_t> frame;
      for (int row = 0; row < 2; ++row) {  // four pixels, and padding
        for (int pair = 0; pair < 2; ++pair) frame.insert(frame.end(), four.begin(), four.end());
        frame.insert(frame.end(), 6, 99);
      }
      const auto colours = colours_later(bytes_of(frame), layout_of(fourcc, 4, 2, 14))();
      ASSERT_TRUE(colours);
      for (std::size_t i = 0; i < colours->size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(colours->data()[i][k], rgb[k], 2) << fourcc;
    }
  }
}

TEST(ColoursLater, ConvertsPlanesOfChroma) {
  using Colour = std::array<double, 3>;
  const std::array<Colour, 4> squares{Colour{200, 30, 60}, {10, 220, 90}, {255, 255, 255}, {40, 50, 210}};
  for (const char* const fourcc : {"NV12", "YU12"}) {
    constexpr std::size_t kWidth = 4, kHeight = 4, kStride = 8;  // four squares of four pixels, and padding
    const bool pairs = std::string(fourcc) == "NV12";
    std::vector<std::uint8_t> frame(kStride * kHeight * 3 / 2, 99);
    for (std::size_t square = 0; square < squares.size(); ++square) {
      const auto [y, cb, cr] = ycc(squares[square]);
      const std::size_t column = square % 2, row = square / 2, chroma = kStride * kHeight;
      for (const std::size_t pixel : {0U, 1U, 2U, 3U})
        frame[kStride * (2 * row + pixel / 2) + 2 * column + pixel % 2] = y;
      const std::size_t plane = kStride / 2 * kHeight / 2;
      frame[chroma + (pairs ? kStride * row + 2 * column : kStride / 2 * row + column)] = cb;
      frame[chroma + (pairs ? kStride * row + 2 * column + 1 : plane + kStride / 2 * row + column)] = cr;
    }
    const FrameLayout layout = layout_of(fourcc, kWidth, kHeight, kStride);
    const auto colours = colours_later(bytes_of(frame), layout)();
    ASSERT_TRUE(colours);
    for (std::size_t i = 0; i < colours->size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(colours->data()[i][k], squares[i / 8 * 2 + i % 4 / 2][k], 2) << fourcc << " pixel " << i;
    const std::size_t end = ChromaPlanes(layout).end;
    EXPECT_LE(end, frame.size());
    EXPECT_TRUE(colours_later(bytes_of(frame).first(end), layout));
    EXPECT_FALSE(colours_later(bytes_of(frame).first(end - 1), layout)) << "luma alone";
  }
}

TEST(ColoursLater, ReadsChromaOfOddSizes) {
  for (const char* const fourcc : {"NV12", "YU12"}) {
    const FrameLayout layout = layout_of(fourcc, 5, 3, 6);
    const std::vector<std::uint8_t> frame(ChromaPlanes(layout).end, 128);
    const auto colours = colours_later(bytes_of(frame), layout)();
    ASSERT_TRUE(colours);
    EXPECT_EQ(*colours, ColourFrame(5, 3, {130, 130, 130})) << fourcc;
  }
}

TEST(ColoursLater, KnowsThePatternOfEveryMosaic) {
  for (const auto& [fourcc, pattern] : {std::pair("RGGB", BayerPattern::kRggb),
                                        {"BA81", BayerPattern::kBggr},
                                        {"GRBG", BayerPattern::kGrbg},
                                        {"GBRG", BayerPattern::kGbrg},
                                        {"RG16", BayerPattern::kRggb},
                                        {"BYR2", BayerPattern::kBggr},
                                        {"GR16", BayerPattern::kGrbg},
                                        {"GB16", BayerPattern::kGbrg},
                                        {"RG12", BayerPattern::kRggb},
                                        {"BG12", BayerPattern::kBggr},
                                        {"BA12", BayerPattern::kGrbg},
                                        {"GB12", BayerPattern::kGbrg},
                                        {"RG10", BayerPattern::kRggb},
                                        {"BG10", BayerPattern::kBggr},
                                        {"BA10", BayerPattern::kGrbg},
                                        {"GB10", BayerPattern::kGbrg}}) {
    const std::string names(to_string(pattern));
    std::vector<std::uint8_t> shallow;
    std::vector<std::uint16_t> deep;
    for (int i = 0; i < 16; ++i) {
      const char name = names[2 * (i / 4 % 2) + i % 2];
      deep.push_back(static_cast<std::uint16_t>(name == 'R' ? 10 : name == 'G' ? 20 : 30));
      shallow.push_back(static_cast<std::uint8_t>(deep.back()));
    }
    const bool is_deep = find_pixel_format(fourcc_from(fourcc))->layout == GreyLayout::kMosaic16;
    const auto later = is_deep ? colours_later(bytes_of(deep), layout_of(fourcc, 4, 4, 8))
                               : colours_later(bytes_of(shallow), layout_of(fourcc, 4, 4, 4));
    EXPECT_EQ(later(), ColourFrame(4, 4, {10, 20, 30})) << fourcc;
  }
}

TEST(ColoursLater, ReadsJpegAfterTheBufferIsGone) {
  std::string jpeg = test::jpeg_bytes(Grey8(32, 16, 240), {.shares = {255, 128, 0}});
  const auto later = colours_later(bytes_of(jpeg), layout_of("MJPG", 32, 16, 0));
  jpeg.assign(jpeg.size(), '\0');
  const auto colours = later();
  ASSERT_TRUE(colours) << to_string(colours.error());
  for (std::size_t i = 0; i < colours->size(); ++i) {
    EXPECT_NEAR(colours->data()[i][0], 240, 3);
    EXPECT_NEAR(colours->data()[i][1], 120, 3);
    EXPECT_NEAR(colours->data()[i][2], 0, 3);
  }
}

TEST(ColoursLater, GivesNoneOfGreyFormats) {
  const std::vector<std::uint8_t> frame(16);
  EXPECT_FALSE(colours_later(bytes_of(frame), layout_of("GREY", 4, 4, 4)));
  EXPECT_FALSE(colours_later(bytes_of(frame), layout_of("Y16", 4, 2, 8)));
}

TEST(ColoursLater, RefusesAnImageOfAnotherSize) {
  const std::string jpeg = test::jpeg_bytes(Grey8(32, 16, 240));
  EXPECT_FALSE(colours_later(bytes_of(jpeg), layout_of("MJPG", 64, 16, 0))().has_value());
  EXPECT_FALSE(colours_later(bytes_of(jpeg.substr(0, 40)), layout_of("MJPG", 32, 16, 0))().has_value());
}

}  // namespace
}  // namespace slsd
