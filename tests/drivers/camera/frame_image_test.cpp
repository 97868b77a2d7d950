// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/frame_image.hpp"

#include <cstdint>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::StartsWith;

/// Rows of two pixels, one more apart than they are wide.
template <class T>
Frame frame_of(const std::vector<T>& rows) {
  return {ImageView<T>{rows.data(), 2, static_cast<int>(rows.size() / 3), 3}, 7,
          MonotonicTime(MonotonicTime::duration(1)), MonotonicTime(MonotonicTime::duration(2))};
}

TEST(FrameImage, HasThePixelsRowByRow) {
  const std::vector<std::uint8_t> rows{'a', 'b', '-', 'c', 'd', '-'};
  const auto image = raw_of(frame_of(rows));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->bytes, "abcd");
  EXPECT_EQ(std::tuple(image->width_px, image->height_px, image->bits), std::tuple(2, 2, 8));
  EXPECT_EQ(image->sequence, 7U);
  EXPECT_EQ(image->exposure_start.time_since_epoch().count(), 1);
  EXPECT_EQ(image->received.time_since_epoch().count(), 2);
}

TEST(FrameImage, OfTwoBytesHasTheLeastFirst) {
  const std::vector<std::uint16_t> rows{0x6261, 0x6463, 0};
  const auto image = raw_of(frame_of(rows));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->bytes, "abcd");
  EXPECT_EQ(image->bits, 16);
  const GreyView view = view_of(*image);
  const auto* const pixels = std::get_if<ImageView<std::uint16_t>>(&view);
  ASSERT_NE(pixels, nullptr);
  EXPECT_EQ(pixels->at(1, 0), 0x6463);
}

TEST(FrameImage, ReusesTheMemoryOfAnother) {
  const std::vector<std::uint8_t> rows{'a', 'b', '-', 'c', 'd', '-'};
  FrameImage image;
  image.bytes = std::string(1000, 'x');
  const char* const memory = image.bytes.data();
  copy_raw(frame_of(rows), image);
  EXPECT_EQ(image.bytes, "abcd");
  EXPECT_EQ(image.bytes.data(), memory);
}

TEST(FrameImage, IsCodedAsAsked) {
  const std::vector<std::uint8_t> rows{'a', 'b', '-', 'c', 'd', '-'};
  const auto png = image_of(frame_of(rows), FrameCoding::kPng, "left");
  const auto raw = image_of(frame_of(rows), FrameCoding::kRaw, "left");
  ASSERT_TRUE(png && raw);
  EXPECT_EQ(png->camera, "left");
  EXPECT_THAT(png->bytes, StartsWith("\x89PNG"));
  EXPECT_EQ(raw->bytes, "abcd");
}

}  // namespace
}  // namespace slsd
