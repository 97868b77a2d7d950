// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>

#include <gmock/gmock.h>

#include "drivers/files/read_image.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using namespace std::string_literals;
using test::plain_pnm_bytes;
using test::pnm_bytes;
using test::ramp8;
using test::samples_of;
using ::testing::HasSubstr;

const Grey8 kImage = ramp8(9, 7);
const std::string kPixels(reinterpret_cast<const char*>(kImage.data()), kImage.size());

Error pnm_refusal(const std::string& file) {
  const auto image = decode_image(file, "file");
  EXPECT_FALSE(image) << file.substr(0, 20);
  return image ? Error{} : image.error();
}

template <class T>
Image<T> row_of(std::initializer_list<T> values) {
  Image<T> image(static_cast<int>(values.size()), 1);
  std::copy(values.begin(), values.end(), image.data());
  return image;
}

TEST(DecodePnm, ReadsEveryHeaderThatTheSpecificationAllows) {
  for (const std::string& header :
       {"P5\n9 7\n255\n"s, "P5 9 7 255 "s, "P5\t9\t7\t255\t"s, "P5\r9\r7\r255\r"s, "P5\n\n 9\n\n7 \n 255\n"s,
        "P5\n# one\n9 7\n# two\n255\n"s, "P5# one\n9# two\n7# three\n255# four\n"s, "P5\n#\n9 7 #\n#\n255\n"s,
        "P5\n# ends in a return\r9 7\r255\n"s, "P5\n009 07\n0255\n"s})
    EXPECT_EQ(decode_image(header + kPixels, "file"), GreyImage(kImage)) << header;
}

TEST(DecodePnm, TakesCarriageReturnAndLineFeedForOneLineEnd) {
  for (const std::string& header :
       {"P5\r\n9 7\r\n255\r\n"s, "P5 9 7 255\r\n"s, "P5\r\n# a comment\r\n9 7\r\n255# max\r\n"s})
    EXPECT_EQ(decode_image(header + kPixels, "file"), GreyImage(kImage)) << header;
}

TEST(DecodePnm, KeepsAFirstPixelThatIsALineFeed) {
  EXPECT_EQ(decode_image("P5\n2 1\n255\n\n\x05", "file"), GreyImage(row_of<std::uint8_t>({10, 5})));
  EXPECT_EQ(decode_image("P5\n2 1\n255\r\n\x05", "file"), GreyImage(row_of<std::uint8_t>({10, 5})));
}

// By the letter its first pixel is a line feed, and every pixel one place off.
TEST(DecodePnm, RefusesAFileOfCarriageReturnsThatIsCutByAByte) {
  EXPECT_THAT(pnm_refusal("P5\r\n9 7\r\n255\r\n" + kPixels.substr(0, 62)).message, HasSubstr("ends early"));
}

TEST(DecodePnm, RefusesBytesThatAreLeftOver) {
  for (const std::string& header : {"P5\n9 7\n255\n\n"s, "P5\n9 7\n255 \n"s, "P5\n9 7 # size\n255 # max\n"s,
                                    "P5\n9 7\n255\n# made by a program\n"s, "P5\r\n9 7\r\n255\r\n\r\n"s})
    EXPECT_THAT(pnm_refusal(header + kPixels).message, AllOf(HasSubstr("9x7"), HasSubstr("left over"))) << header;
  for (const std::string& after : {"\n"s, "\0"s, "P"s, "P5"s, "P5 9 7 255\n"s, std::string(63, 'x')})
    EXPECT_THAT(pnm_refusal("P5\n9 7\n255\n" + kPixels + after).message, HasSubstr("left over")) << after;
  EXPECT_THAT(pnm_refusal("P2\n2 1\n255\n3 4\n5").message, HasSubstr("left over"));
}

TEST(DecodePnm, ReadsTheFirstOfSeveralImages) {
  const std::string one = pnm_bytes(samples_of(kImage)), other = pnm_bytes(samples_of(ramp8(4, 3, 100)));
  EXPECT_EQ(decode_image(one + other, "file"), GreyImage(kImage));
  EXPECT_EQ(decode_image(one + other + one, "file"), GreyImage(kImage));
  pnm_refusal(one + other.substr(0, other.size() - 1));
  pnm_refusal(one + other + "\n");
}

TEST(DecodePnm, ScalesToTheWholeRange) {
  const GreyImage expected = row_of<std::uint8_t>({0, 128, 255});
  EXPECT_EQ(decode_image("P5 3 1 100\n\0\x32\x64"s, "file"), expected);
  EXPECT_EQ(decode_image("P2 3 1 100\n0 50 100\n", "file"), expected);
  EXPECT_EQ(decode_image("P5 2 1 1\n\0\x01"s, "file"), GreyImage(row_of<std::uint8_t>({0, 255})));
  const GreyImage deep = row_of<std::uint16_t>({0, 32800, 65535});
  EXPECT_EQ(decode_image("P5 3 1 999\n\0\0\x01\xf4\x03\xe7"s, "file"), deep);
  EXPECT_EQ(decode_image("P2 3 1 999\n0 500 999"s, "file"), deep);
  EXPECT_EQ(decode_image("P6 1 1 100\n\x64\x64\x64", "file"), GreyImage(row_of<std::uint8_t>({255})));
}

TEST(DecodePnm, RefusesValuesAboveTheGreatest) {
  for (const std::string& file : {"P5 2 1 100\n\x64\x65"s, "P2 2 1 100\n100 101"s, "P5 1 1 1000\n\x03\xe9"s,
                                  "P2 1 1 1000\n1001"s, "P6 1 1 100\n\x01\x02\x65"s, "P3 1 1 100\n1 2 101"s})
    EXPECT_THAT(pnm_refusal(file).message, HasSubstr("says at most 100")) << file;
}

TEST(DecodePnm, RefusesGreatestValuesThatThereAreNot) {
  for (const char* greatest : {"0", "65536", "-1", "x", ""}) pnm_refusal("P5\n9 7\n"s + greatest + "\n" + kPixels);
}

}  // namespace
}  // namespace slsd
