// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/grey_converter.hpp"

#include <string>

#include <gmock/gmock.h>

#include "drivers/files/read_image.hpp"
#include "tests/drivers/jpeg_bytes.hpp"

namespace slsd {
namespace {

using test::busy_image;
using test::jpeg_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kWidthPx = 320, kHeightPx = 240;

/// A camera's MJPG frames of 320x240.
class MotionJpeg : public ::testing::Test {
 protected:
  Result<GreyImage> convert(std::string jpeg) {
    FrameLayout layout;
    layout.mode = {*find_pixel_format(fourcc_from("MJPG")), kWidthPx, kHeightPx};
    GreyConverter converter(layout);
    return converter.convert(std::as_writable_bytes(std::span(jpeg))).map([](const GreyView& grey) {
      return copy_of(grey);
    });
  }

  Error refused(const std::string& jpeg) {
    const auto frame = convert(jpeg);
    EXPECT_FALSE(frame);
    return frame ? Error{} : frame.error();
  }

  std::string jpeg_ = jpeg_bytes(busy_image(kWidthPx, kHeightPx));
};

TEST_F(MotionJpeg, IsDecodedAsAFileIs) {
  for (const int components : {1, 3}) {
    for (const int interval : {0, 20}) {
      const std::string jpeg =
          jpeg_bytes(busy_image(kWidthPx, kHeightPx), {.components = components, .restart_interval = interval});
      const auto file = decode_image(jpeg, "file");
      ASSERT_TRUE(file) << to_string(file.error());
      for (const std::string& frame : {jpeg, jpeg + std::string(1000, '\0'), test::without_segments(jpeg, 0xc4)}) {
        const auto converted = convert(frame);
        ASSERT_TRUE(converted) << to_string(converted.error());
        EXPECT_EQ(*converted, *file);
      }
    }
  }
}

TEST_F(MotionJpeg, IsTornWithAHoleInside) {
  for (const std::size_t part : {1, 2, 3}) {
    const Error error = refused(std::string(jpeg_).erase(jpeg_.size() * part / 4, 512));
    EXPECT_EQ(error.code, ErrorCode::kFrameTorn);
    EXPECT_THAT(error.message, AllOf(HasSubstr("missing"), HasSubstr("scan again")));
  }
}

TEST_F(MotionJpeg, IsTornWithoutItsEnd) {
  EXPECT_EQ(refused(jpeg_.substr(0, jpeg_.size() - 2)).code, ErrorCode::kFrameTorn);
  EXPECT_EQ(refused(jpeg_.substr(0, jpeg_.size() / 2)).code, ErrorCode::kFrameTorn);
  EXPECT_EQ(refused("").code, ErrorCode::kFrameTorn);
}

TEST_F(MotionJpeg, NamesBothSizesWhereTheyDiffer) {
  const Error error = refused(jpeg_bytes(busy_image(160, 120)));
  EXPECT_EQ(error.code, ErrorCode::kFrameTorn);
  EXPECT_THAT(error.message, AllOf(HasSubstr("160x120"), HasSubstr("320x240")));
}

TEST_F(MotionJpeg, NamesColoursThatAreNotRead) {
  const Error error = refused(jpeg_bytes(busy_image(kWidthPx, kHeightPx), {.components = 4}));
  EXPECT_EQ(error.code, ErrorCode::kUnsupported);
  EXPECT_THAT(error.message, HasSubstr("CMYK"));
}

}  // namespace
}  // namespace slsd
