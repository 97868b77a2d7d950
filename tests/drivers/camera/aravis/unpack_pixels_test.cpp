// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

#include <array>
#include <cstring>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "drivers/camera/aravis/frames/pixel_layout.hpp"
#include "tests/doubles/gige/frames/pack_pixels.hpp"

namespace slsd {
namespace {

using ::testing::ElementsAre;

std::vector<int> unpacked(const std::vector<std::uint8_t>& bytes, PixelPacking packing) {
  Grey16 image(2, 2);
  unpack_pixels(bytes, packing, image);
  return {image.data(), image.data() + image.size()};
}

// 0x001, 0x3ff, 0x155, 0x2aa, by hand.
TEST(UnpackPixels, TakesTenBitsFromTheLowestOn) {
  EXPECT_THAT(unpacked({0x01, 0xfc, 0x5f, 0x95, 0xaa}, PixelPacking::kLsb10), ElementsAre(0x001, 0x3ff, 0x155, 0x2aa));
}

TEST(UnpackPixels, TakesTwelveBitsFromTheLowestOn) {
  EXPECT_THAT(unpacked({0x01, 0xf0, 0xff, 0x55, 0xa5, 0xaa}, PixelPacking::kLsb12),
              ElementsAre(0x001, 0xfff, 0x555, 0xaaa));
}

TEST(UnpackPixels, TakesLowBitsFromTheByteBetween) {
  EXPECT_THAT(unpacked({0x00, 0x31, 0xff, 0x55, 0x21, 0xaa}, PixelPacking::kGige10),
              ElementsAre(0x001, 0x3ff, 0x155, 0x2aa));
  EXPECT_THAT(unpacked({0x00, 0xf1, 0xff, 0x55, 0xa5, 0xaa}, PixelPacking::kGige12),
              ElementsAre(0x001, 0xfff, 0x555, 0xaaa));
}

RC_GTEST_PROP(UnpackPixels, UndoesThePackingOfACamera, ()) {
  const char* name = *rc::gen::element("Mono10p", "Mono12p", "Mono10Packed", "Mono12Packed");
  const PixelLayout layout = *find_pixel_layout(name);
  Grey16 image(2 * *rc::gen::inRange(1, 20), *rc::gen::inRange(1, 20));
  const int bits = test::used_bits(layout.code);
  for (std::size_t i = 0; i < image.size(); ++i)
    image.data()[i] = static_cast<std::uint16_t>(*rc::gen::inRange(0, 1 << bits));
  std::vector<std::uint8_t> bytes(2 * image.size());
  std::memcpy(bytes.data(), image.data(), bytes.size());
  test::pack_pixels(layout.code, bytes);
  RC_ASSERT(bytes.size() == packed_bytes(image.size(), layout.bits_per_pixel()));
  Grey16 back(image.width(), image.height());
  unpack_pixels(bytes, layout.packing, back);
  RC_ASSERT(back == image);
}

}  // namespace
}  // namespace slsd
