// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/frame_chunks.hpp"

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void put_word(std::vector<std::uint8_t>& frame, std::size_t value, std::endian order) {
  for (int i = 0; i < 4; ++i) {
    const int shift = order == std::endian::big ? 24 - 8 * i : 8 * i;
    frame.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

// Cameras number their chunks so: above any length that a frame has.
constexpr std::size_t kFirstId = 0xa0000001;

/// The first is the image.
std::vector<std::uint8_t> frame_of(const std::vector<std::size_t>& lengths, std::endian order = std::endian::big) {
  std::vector<std::uint8_t> frame;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    frame.insert(frame.end(), lengths[i], 0x55);
    put_word(frame, kFirstId + i, order);
    put_word(frame, lengths[i], order);
  }
  return frame;
}

TEST(IsImageWithChunks, TakesAnImageAndItsChunksInEitherOrderOfBytes) {
  for (const std::endian order : {std::endian::big, std::endian::little}) {
    EXPECT_TRUE(is_image_with_chunks(frame_of({100, 8, 8, 8}, order), 100, order));
    EXPECT_TRUE(is_image_with_chunks(frame_of({100}, order), 100, order));
    EXPECT_TRUE(is_image_with_chunks(frame_of({100, 0, 4}, order), 97, order));
  }
  EXPECT_FALSE(is_image_with_chunks(frame_of({100, 8}, std::endian::little), 100, std::endian::big));
}

TEST(IsImageWithChunks, RefusesAnImageOfAnotherSize) {
  for (const std::size_t bytes : {0, 50, 99, 104, 200})
    EXPECT_FALSE(is_image_with_chunks(frame_of({bytes, 8, 8}), 100, std::endian::big)) << bytes;
}

TEST(IsImageWithChunks, RefusesAnImageAlone) {
  EXPECT_FALSE(is_image_with_chunks(std::vector<std::uint8_t>(100, 0), 100, std::endian::big));
  EXPECT_FALSE(is_image_with_chunks(std::vector<std::uint8_t>(124, 0), 100, std::endian::big));
  EXPECT_FALSE(is_image_with_chunks({}, 0, std::endian::big));
}

RC_GTEST_PROP(IsImageWithChunks, RefusesAFrameThatEndsTooEarly, ()) {
  const auto frame = frame_of({64, *rc::gen::inRange<std::size_t>(1, 40), *rc::gen::inRange<std::size_t>(1, 40)});
  RC_ASSERT(is_image_with_chunks(frame, 64, std::endian::big));
  const auto bytes = *rc::gen::inRange<std::size_t>(0, frame.size());
  // Where whole chunks are missing nothing tells; that one is missing does.
  const std::size_t without_last = frame.size() - 8 - frame[frame.size() - 1];
  RC_PRE(bytes != without_last && bytes != 72u);
  RC_ASSERT(!is_image_with_chunks(std::span(frame).first(bytes), 64, std::endian::big));
}

RC_GTEST_PROP(IsImageWithChunks, ReadsNothingBeyondAnyBytes, (const std::vector<std::uint8_t>& bytes)) {
  const auto image_bytes = *rc::gen::inRange<std::size_t>(0, 64);
  const std::vector<std::uint8_t> exact(bytes.begin(), bytes.end());
  if (is_image_with_chunks(exact, image_bytes, std::endian::big)) RC_ASSERT(exact.size() >= image_bytes + 8);
}

AravisCameraOptions set_to(double exposure_us, double gain_db) {
  AravisCameraOptions options;
  options.exposure_us = exposure_us;
  options.gain_db = gain_db;
  return options;
}

FrameChunks settings(std::optional<double> exposure_us, std::optional<double> gain_db) {
  return {std::nullopt, exposure_us, gain_db};
}

TEST(UnlikeConfigured, AllowsWhatSensorsRound) {
  const AravisCameraOptions options = set_to(10000.0, 3.0);
  EXPECT_THAT(unlike_configured(settings(10000.0, 3.0), options), IsEmpty());
  EXPECT_THAT(unlike_configured(settings(10190.0, 3.15), options), IsEmpty());
  EXPECT_THAT(unlike_configured(settings(std::nullopt, std::nullopt), options), IsEmpty());
  EXPECT_THAT(unlike_configured(settings(134.0, std::nullopt), set_to(100.0, 0.0)), IsEmpty());
}

TEST(UnlikeConfigured, NamesWhatDiffersAndByHowMuch) {
  const AravisCameraOptions options = set_to(10000.0, 3.0);
  EXPECT_THAT(unlike_configured(settings(20000.0, 3.0), options),
              HasSubstr("its exposure was 20000 us, but 10000 is configured"));
  EXPECT_THAT(unlike_configured(settings(10000.0, 4.0), options), HasSubstr("its gain was 4 dB, but 3 is configured"));
  EXPECT_THAT(unlike_configured(settings(0.0, std::nullopt), set_to(20.0, 0.0)), HasSubstr("exposure"));
  EXPECT_THAT(unlike_configured(settings(std::nan(""), std::nullopt), options), HasSubstr("exposure"));
}

TEST(ChunkTime, TakesTicksOrNanosecondsWhicheverIsNearer) {
  EXPECT_EQ(chunk_time(1'250'000'000, 10'005ms, 125'000'000, 100ms), 10s);
  EXPECT_EQ(chunk_time(10'000'000'000, 10'005ms, 125'000'000, 100ms), 10s);
  EXPECT_EQ(chunk_time(10'000'000'000, 10'005ms, 0, 100ms), 10s);
}

TEST(ChunkTime, RefusesTheTimeOfAnotherFrameOrClock) {
  EXPECT_EQ(chunk_time(1'250'000'000, 11'005ms, 125'000'000, 100ms), std::nullopt);
  EXPECT_EQ(chunk_time(0, 10s, 125'000'000, 100ms), std::nullopt);
}

RC_GTEST_PROP(ChunkTime, IsNearTheFramesOwnStampOrNothing, (std::uint64_t value, std::int64_t stamp)) {
  const auto frequency = *rc::gen::element<std::uint64_t>(0, 1, 1000, 125'000'000, 1'000'000'000, ~0ull);
  const auto time = chunk_time(value, nanoseconds(stamp), frequency, 1s);
  if (time) RC_ASSERT(std::chrono::abs(*time - nanoseconds(stamp)) <= 1s);
}

}  // namespace
}  // namespace slsd
