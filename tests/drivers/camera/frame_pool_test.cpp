// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/frame_pool.hpp"

#include <chrono>
#include <optional>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "tests/drivers/allocations.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using std::chrono::steady_clock;
using test::ramp16;
using test::ramp8;

std::uint8_t first_pixel(const Frame& frame) {
  return std::get<ImageView<std::uint8_t>>(frame.image()).at(0, 0);
}

TEST(FramePool, CopiesThePixelsAndTheStamps) {
  FramePool pool({5, 3, 2}, 2);
  const Grey16 image = ramp16(5, 3);
  const MonotonicTime exposure_start = steady_clock::now();
  const auto frame = pool.lend(image.view(), 42, exposure_start);
  ASSERT_TRUE(frame);
  const auto seen = std::get<ImageView<std::uint16_t>>(frame->image());
  EXPECT_NE(seen.pixels, image.data());
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x) EXPECT_EQ(seen.at(x, y), image.at(x, y));
  EXPECT_EQ(frame->sequence(), 42u);
  EXPECT_EQ(frame->exposure_start(), exposure_start);
  EXPECT_GE(frame->received(), exposure_start);
}

TEST(FramePool, LendsEachBufferOnceUntilItIsGivenBack) {
  FramePool pool({5, 3, 1}, 2);
  auto a = pool.lend(ramp8(5, 3, 1).view(), 0, {});
  const auto b = pool.lend(ramp8(5, 3, 2).view(), 1, {});
  EXPECT_FALSE(pool.lend(ramp8(5, 3, 3).view(), 2, {}));
  EXPECT_EQ(first_pixel(*a), 1);
  EXPECT_EQ(first_pixel(*b), 2);
  a.reset();
  const auto c = pool.lend(ramp8(5, 3, 3).view(), 2, {});
  ASSERT_TRUE(c);
  EXPECT_EQ(first_pixel(*c), 3);
  EXPECT_EQ(first_pixel(*b), 2);
}

TEST(FramePool, GivesAMovedFrameBackOnce) {
  FramePool pool({5, 3, 1}, 1);
  {
    Frame moved(std::move(*pool.lend(ramp8(5, 3).view(), 0, {})));
    EXPECT_FALSE(pool.lend(ramp8(5, 3).view(), 1, {}));
  }
  EXPECT_TRUE(pool.lend(ramp8(5, 3).view(), 1, {}));
}

TEST(FramePool, TakesARestampedFrameBackOnce) {
  FramePool pool({5, 3, 1}, 1);
  const MonotonicTime early = steady_clock::now(), late = early + std::chrono::seconds(1);
  {
    const Frame restamped = std::move(*pool.lend(ramp8(5, 3, 4).view(), 7, {})).restamped(early, late);
    EXPECT_EQ(restamped.exposure_start(), early);
    EXPECT_EQ(restamped.received(), late);
    EXPECT_EQ(restamped.sequence(), 7u);
    EXPECT_EQ(first_pixel(restamped), 4);
    EXPECT_FALSE(pool.lend(ramp8(5, 3).view(), 8, {}));
  }
  EXPECT_TRUE(pool.lend(ramp8(5, 3).view(), 8, {}));
}

TEST(FramePool, MayEndBeforeItsFrames) {
  std::optional<Frame> frame;
  {
    FramePool pool({5, 3, 1}, 2);
    frame.emplace(std::move(*pool.lend(ramp8(5, 3, 9).view(), 0, {})));
  }
  EXPECT_EQ(first_pixel(*frame), 9);
}

TEST(FramePool, TakesFramesBackFromOtherThreads) {
  FramePool pool({5, 3, 1}, 4);
  const Grey8 image = ramp8(5, 3);
  std::vector<std::jthread> readers;
  for (std::uint64_t i = 0; i < 200; ++i) {
    auto frame = pool.lend(image.view(), i, {});
    if (!frame) {
      readers.clear();
      continue;
    }
    readers.emplace_back([held = std::move(*frame)] { EXPECT_EQ(first_pixel(held), 0); });
  }
  readers.clear();
  EXPECT_TRUE(pool.lend(image.view(), 0, {}));
}

TEST(FramePool, TakesMemoryAsFarAsItIsLent) {
  const double before_mib = test::resident_mib();
  FramePool pool({8192, 8192, 1}, 4);                  // 256 MiB
  EXPECT_LT(test::resident_mib() - before_mib, 64.0);  // the shadow of the address sanitizer is an eighth
  const Grey8 image = ramp8(8192, 8192);
  const double with_image_mib = test::resident_mib();
  for (std::uint64_t i = 0; i < 4; ++i) EXPECT_TRUE(pool.lend(image.view(), i, {}).has_value());
  EXPECT_LT(test::resident_mib() - with_image_mib, 100.0);  // one frame after the other is in the same buffer
}

TEST(FramePool, AllocatesNothingToLend) {
  FramePool pool({64, 48, 1}, 3);
  const Grey8 image = ramp8(64, 48);
  const std::uint64_t before = test::allocations();
  for (std::uint64_t i = 0; i < 1000; ++i) EXPECT_TRUE(pool.lend(image.view(), i, {}).has_value());
  EXPECT_EQ(test::allocations(), before);
}

}  // namespace
}  // namespace slsd
