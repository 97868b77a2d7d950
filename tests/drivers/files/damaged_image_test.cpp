// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <functional>
#include <random>
#include <string>

#include <gmock/gmock.h>

#include "drivers/files/encode_png.hpp"
#include "drivers/files/read_image.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using test::ramp16;
using test::ramp8;
using test::Samples;
using test::samples_of;

struct Format {
  const char* name;
  std::function<std::string()> bytes;
};

Samples colour_samples() {
  Samples samples{9, 7, 3, 8, {}};
  for (std::uint16_t i = 0; i < 9 * 7 * 3; ++i) samples.values.push_back(5 * i % 256);
  return samples;
}

class DamagedImage : public ::testing::TestWithParam<Format> {};

/// The pixels of a plain PNM may end within its last number; nowhere else does a cut file look whole.
bool only_last_digits_differ(const std::string& whole, std::size_t size) {
  return whole[1] == '2' && whole.find_first_not_of("0123456789\n", size) == std::string::npos &&
         whole.size() - size < 4;
}

TEST_P(DamagedImage, IsAnErrorWhereverItIsCutShort) {
  const std::string whole = GetParam().bytes();
  const auto image = decode_image(whole, "file");
  ASSERT_TRUE(image) << to_string(image.error());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    if (only_last_digits_differ(whole, size)) continue;
    const auto cut = decode_image(whole.substr(0, size), "file");
    if (!cut) continue;
    EXPECT_EQ(*cut, *image) << "cut to " << size << " of " << whole.size();
    EXPECT_GE(size + 4, whole.size()) << "only what follows the pixels may be missing";
  }
}

TEST_P(DamagedImage, NeverBreaksTheReader) {
  const std::string whole = GetParam().bytes();
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = whole;
    for (int flips = 0; flips < 1 + i % 4; ++flips) bytes[random() % bytes.size()] = static_cast<char>(random());
    const auto image = decode_image(bytes, "file", {.limit_decoded_bytes = 1u << 20});
    EXPECT_TRUE(image || !image.error().message.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, DamagedImage,
    ::testing::Values(Format{"PgmRaw8", [] { return test::pnm_bytes(samples_of(ramp8(9, 7))); }},
                      Format{"PgmRaw16", [] { return test::pnm_bytes(samples_of(ramp16(9, 7))); }},
                      Format{"PgmPlain", [] { return test::plain_pnm_bytes(samples_of(ramp8(9, 7))); }},
                      Format{"PpmRaw", [] { return test::pnm_bytes(colour_samples()); }},
                      Format{"PngStored", [] { return test::png_bytes(samples_of(ramp8(9, 7))); }},
                      Format{"PngColour", [] { return test::png_bytes(colour_samples()); }},
                      Format{"PngInterlaced", [] { return test::png_bytes(samples_of(ramp16(9, 7)), true); }},
                      Format{"PngCompressed", [] { return *encode_png(ramp16(40, 30)); }},
                      Format{"TiffLittle", [] { return test::tiff_bytes(samples_of(ramp8(9, 7)), false); }},
                      Format{"TiffBig16", [] { return test::tiff_bytes(samples_of(ramp16(9, 7)), true); }},
                      Format{"TiffColour", [] { return test::tiff_bytes(colour_samples(), false); }}),
    [](const auto& instance) { return instance.param.name; });

TEST(DecodeImage, RefusesHugeDeclaredSizesBeforeItTakesTheMemory) {
  const Samples small = samples_of(ramp8(4, 4));
  for (std::string file : {test::png_bytes(small), test::tiff_bytes(small, true)}) {
    const bool png = file[0] == '\x89';
    const std::size_t width_at = png ? 16 : file.find(std::string("\x01\x00\x00\x04", 4)) + 8;
    file[width_at] = 0x7f;
    const auto refused = decode_image(file, "file");
    ASSERT_FALSE(refused);
    EXPECT_FALSE(refused.error().message.empty());
  }
  EXPECT_FALSE(decode_image("P5 2147483647 2147483647 65535\nxx", "file"));
  EXPECT_FALSE(decode_image("P5 99999999999999999999 1 255\nxx", "file"));
}

TEST(DecodeImage, RefusesMoreThanTheLimits) {
  const std::string file = test::png_bytes(samples_of(ramp16(10, 10)));
  EXPECT_TRUE(decode_image(file, "file", {.limit_decoded_bytes = 200}));
  const auto refused = decode_image(file, "file", {.limit_decoded_bytes = 199});
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("10x10"));
  EXPECT_EQ(decode_image(file, "file", {.limit_file_bytes = 100}).error().code, ErrorCode::kInvalidArgument);
}

TEST(DecodeImage, RefusesKindsThatWouldNotBeDecodedFaithfully) {
  EXPECT_EQ(decode_image("P4\n8 1\nx", "file").error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(decode_image("BM, a Windows bitmap", "file").error().code, ErrorCode::kUnsupported);
  std::string tiff = test::tiff_bytes(samples_of(ramp8(4, 4)), true);
  tiff[tiff.find(std::string("\x01\x03\x00\x03\x00\x00\x00\x01\x00\x01", 10)) + 9] = 7;  // JPEG
  EXPECT_EQ(decode_image(tiff, "file").error().code, ErrorCode::kUnsupported);
}

}  // namespace
}  // namespace slsd
