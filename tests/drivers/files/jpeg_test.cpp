// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdlib>
#include <random>
#include <string>

#include <gmock/gmock.h>

#include "drivers/files/read_image.hpp"
#include "tests/drivers/jpeg_bytes.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using namespace std::string_literals;
using test::busy_image;
using test::jpeg_bytes;
using test::JpegKind;
using test::scan_begin;
using ::testing::HasSubstr;

GreyImage decoded(const std::string& jpeg) {
  auto image = decode_image(jpeg, "file");
  EXPECT_TRUE(image) << to_string(image.error());
  return image ? std::move(*image) : GreyImage();
}

Error jpeg_refusal(const std::string& jpeg) {
  const auto image = decode_image(jpeg, "file");
  EXPECT_FALSE(image);
  return image ? Error{} : image.error();
}

/// Where the restart markers are.
std::vector<std::size_t> restarts(const std::string& jpeg) {
  std::vector<std::size_t> places;
  for (std::size_t at = scan_begin(jpeg); at + 1 < jpeg.size(); ++at)
    if (jpeg[at] == '\xff' && (jpeg[at + 1] & 0xf8) == 0xd0) places.push_back(at);
  return places;
}

class SoundJpeg : public ::testing::TestWithParam<JpegKind> {
 protected:
  Grey8 image_ = busy_image(203, 117);
  std::string jpeg_ = jpeg_bytes(image_, GetParam());
};
INSTANTIATE_TEST_SUITE_P(Kinds, SoundJpeg,
                         ::testing::Values(JpegKind{.components = 1}, JpegKind{.components = 3},
                                           JpegKind{.components = 1, .restart_interval = 5},
                                           JpegKind{.components = 3, .restart_interval = 7},
                                           JpegKind{.components = 3, .progressive = true},
                                           JpegKind{.components = 1, .progressive = true}));

TEST_P(SoundJpeg, IsReadAsItWasWritten) {
  const auto read = std::get<Grey8>(decoded(jpeg_));
  ASSERT_EQ(read.size(), image_.size());
  double off = 0;
  for (std::size_t i = 0; i < read.size(); ++i) off += std::abs(read.data()[i] - image_.data()[i]);
  EXPECT_LT(off / static_cast<double>(read.size()), 4.0);
}

TEST_P(SoundJpeg, MayHaveBytesAfterItsEnd) {
  const GreyImage whole = decoded(jpeg_);
  for (const std::string& after : {"\0"s, std::string(4096, '\0'), "\xff\xd8 rubbish"s, std::string(7, '\xff')})
    EXPECT_EQ(decoded(jpeg_ + after), whole);
}

TEST_P(SoundJpeg, MayHaveBytesBeforeAHeader) {
  const std::size_t first = jpeg_.find("\xff\xdb");
  EXPECT_EQ(decoded(jpeg_.substr(0, first) + "\x01\x02\x03" + jpeg_.substr(first)), decoded(jpeg_));
}

TEST_P(SoundJpeg, IsRefusedWhereverItIsCut) {
  const std::size_t begin = scan_begin(jpeg_);
  for (std::size_t size = 4; size + 2 < jpeg_.size(); size += size < begin ? 7 : 97)
    for (const std::string& end : {""s, "\xff\xd9"s})
      EXPECT_EQ(jpeg_refusal(jpeg_.substr(0, size) + end).code, ErrorCode::kMalformed) << size;
}

TEST(DecodeJpeg, TakesBytesBeforeARestartMarkerThatAreNoBlocks) {
  const std::string jpeg = jpeg_bytes(busy_image(320, 240), {.restart_interval = 20});
  const GreyImage whole = decoded(jpeg);
  std::mt19937 random(1);
  for (const std::size_t at : restarts(jpeg)) {
    std::string more;
    for (std::size_t i = 0; i < 1 + random() % 8; ++i) more.push_back(static_cast<char>(random() % 255));
    EXPECT_EQ(decoded(std::string(jpeg).insert(at, more)), whole) << "before the marker at " << at;
    EXPECT_EQ(decoded(std::string(jpeg).insert(at, 5, '\xff')), whole) << "fill bytes";
  }
  EXPECT_EQ(decoded(std::string(jpeg).insert(jpeg.size() - 2, "\x12\x34")), whole);
}

TEST(DecodeJpeg, TakesTheStandardsTablesWhereThereAreNone) {
  for (const int components : {1, 3}) {
    const std::string jpeg = jpeg_bytes(busy_image(64, 48), {.components = components});
    const std::string without = test::without_segments(jpeg, 0xc4);
    ASSERT_LT(without.size(), jpeg.size());
    EXPECT_EQ(decoded(without), decoded(jpeg));
  }
}

class Hole : public ::testing::TestWithParam<JpegKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, Hole,
                         ::testing::Values(JpegKind{.components = 1}, JpegKind{.components = 3},
                                           JpegKind{.components = 1, .restart_interval = 80},
                                           JpegKind{.components = 3, .restart_interval = 40}));

// A packet of USB that was lost. A hole within a block or two, 100 bytes each here, may leave a valid image.
TEST_P(Hole, IsAlwaysNoticed) {
  const std::string jpeg = jpeg_bytes(busy_image(640, 480), GetParam());
  const std::size_t begin = scan_begin(jpeg), end = jpeg.size() - 2;
  std::mt19937 random(1);
  for (int i = 0; i < 250; ++i) {
    const std::size_t size = std::size_t{512} << random() % 6;
    const std::size_t at = begin + random() % (end - begin - size);
    EXPECT_EQ(jpeg_refusal(std::string(jpeg).erase(at, size)).code, ErrorCode::kMalformed)
        << size << " bytes at " << at;
  }
}

// A whole number of cycles of restart markers: their order shows nothing.
TEST(Hole, IsNoticedAcrossEightRestartMarkers) {
  const std::string jpeg = jpeg_bytes(busy_image(640, 480), {.restart_interval = 40});
  const auto places = restarts(jpeg);
  ASSERT_GT(places.size(), 20u);
  jpeg_refusal(std::string(jpeg).erase(places[3], places[11] - places[3]));
}

TEST(LeftOverBlocks, AreNoticedBeforeARestartMarker) {
  std::string jpeg = jpeg_bytes(busy_image(320, 240), {.restart_interval = 20});
  jpeg[jpeg.find("\xff\xdd") + 5] = 19;
  EXPECT_THAT(jpeg_refusal(jpeg).message, HasSubstr("more data than blocks"));
}

TEST(LeftOverBlocks, AreNoticedBeforeTheEnd) {
  for (const int components : {1, 3}) {
    std::string jpeg = jpeg_bytes(busy_image(320, 240), {.components = components});
    jpeg[jpeg.find("\xff\xc0") + 6] = static_cast<char>(240 - 16);
    EXPECT_THAT(jpeg_refusal(jpeg).message, HasSubstr("more data than blocks"));
  }
}

// A flat block takes six bits, which pass for padding in libjpeg's eyes.
TEST(LeftOverBlocks, AreNoticedWithinAByte) {
  std::string jpeg = jpeg_bytes(Grey8(24, 8), {.components = 1});
  decoded(jpeg);
  jpeg[jpeg.find("\xff\xc0") + 8] = 16;
  EXPECT_THAT(jpeg_refusal(jpeg).message, HasSubstr("more data than blocks"));
}

TEST(DecodeJpeg, RefusesAProgressiveImageThatLacksAScan) {
  const std::string jpeg = jpeg_bytes(busy_image(64, 48), {.components = 1, .progressive = true});
  const std::size_t last = jpeg.rfind("\xff\xda");
  ASSERT_GT(last, scan_begin(jpeg));
  jpeg_refusal(jpeg.substr(0, last) + "\xff\xd9");
}

TEST(DecodeJpeg, NamesTheKindThatItDoesNotRead) {
  const Error cmyk = jpeg_refusal(jpeg_bytes(busy_image(64, 48), {.components = 4}));
  EXPECT_EQ(cmyk.code, ErrorCode::kUnsupported);
  EXPECT_THAT(cmyk.message, AllOf(HasSubstr("CMYK"), HasSubstr("save it as")));
  std::string deep = jpeg_bytes(busy_image(64, 48));
  deep[deep.find("\xff\xc0") + 4] = 12;
  EXPECT_THAT(jpeg_refusal(jpeg_bytes(busy_image(64, 48), {.arithmetic = true})).message, HasSubstr("arithmetic"));
  EXPECT_THAT(jpeg_refusal(deep).message, HasSubstr("12 bits per sample"));
  std::string lossless = jpeg_bytes(busy_image(64, 48));
  lossless[lossless.find("\xff\xc0") + 1] = '\xc3';
  EXPECT_THAT(jpeg_refusal(lossless).message, HasSubstr("lossless"));
}

TEST(DecodeJpeg, NeverBreaksOnChangedBytes) {
  std::mt19937 random(1);
  for (const JpegKind& kind :
       {JpegKind{.components = 1}, JpegKind{.restart_interval = 3}, JpegKind{.progressive = true}}) {
    const std::string jpeg = jpeg_bytes(test::ramp8(40, 30), kind);
    for (int i = 0; i < 1000; ++i) {
      std::string bytes = jpeg;
      for (int flips = 0; flips < 1 + i % 4; ++flips)
        bytes[2 + random() % (bytes.size() - 2)] = static_cast<char>(random());
      const auto image = decode_image(bytes, "file", {.limit_decoded_bytes = 1u << 20});
      EXPECT_TRUE(image || !image.error().message.empty());
    }
  }
}

}  // namespace
}  // namespace slsd
