// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/encode_png.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "drivers/files/read_image.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

TEST(EncodePng, KeepsEveryGreyPixel) {
  const Grey8 grey = test::ramp8(31, 17);
  EXPECT_EQ(decode_image(*encode_png(grey), "file"), GreyImage(grey));
  const Grey16 deep = test::ramp16(31, 17);
  EXPECT_EQ(decode_image(*encode_png(deep), "file"), GreyImage(deep));
}

TEST(EncodePng, WritesAViewWithItsStride) {
  const Grey8 grey = test::ramp8(31, 17);
  Grey8 part(10, 5);
  for (int y = 0; y < 5; ++y) std::copy_n(grey.row(y + 2) + 3, 10, part.row(y));
  const GreyView view = ImageView<std::uint8_t>{grey.row(2) + 3, 10, 5, 31};
  EXPECT_EQ(decode_image(*encode_png(view), "file"), GreyImage(part));
}

TEST(EncodePng, KeepsColoursInTheirOrder) {
  ColourImage image(3, 1);
  image.at(0, 0) = {255, 0, 0};
  image.at(1, 0) = {0, 255, 0};
  image.at(2, 0) = {0, 0, 255};
  Grey8 weights(3, 1);
  weights.at(0, 0) = 76;
  weights.at(1, 0) = 150;
  weights.at(2, 0) = 29;
  EXPECT_EQ(decode_image(*encode_png(image), "file"), GreyImage(weights));
}

TEST(EncodePng, RefusesAnEmptyImage) {
  EXPECT_EQ(encode_png(Grey8()).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(encode_png(ColourImage()).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace slsd
