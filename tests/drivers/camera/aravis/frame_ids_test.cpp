// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/frame_counts.hpp"

#include <gtest/gtest.h>

namespace slsd {
namespace {

TEST(FrameIds, CountsWhatIsMissing) {
  FrameIds ids;
  EXPECT_EQ(ids.note(7), 0u);
  EXPECT_EQ(ids.note(8), 0u);
  EXPECT_EQ(ids.note(11), 2u);
}

TEST(FrameIds, GoesOnAfterTheLastOfSixteenBits) {
  FrameIds ids;
  EXPECT_EQ(ids.note(65535), 0u);
  EXPECT_EQ(ids.note(1), 0u);
  ids.forget();
  EXPECT_EQ(ids.note(65534), 0u);
  EXPECT_EQ(ids.note(2), 2u);
}

TEST(FrameIds, MissesNoneWhereACameraGoesOnWithZero) {
  FrameIds ids;
  EXPECT_EQ(ids.note(65535), 0u);
  EXPECT_EQ(ids.note(0), 0u);
  EXPECT_EQ(ids.note(1), 0u);
  ids.forget();
  EXPECT_EQ(ids.note(65534), 0u);
  EXPECT_EQ(ids.note(0), 1u);
}

TEST(FrameIds, DoesNotWrapSixtyFourBits) {
  FrameIds ids;
  EXPECT_EQ(ids.note(65535), 0u);
  EXPECT_EQ(ids.note(65536), 0u);
  EXPECT_EQ(ids.note(65540), 3u);
}

TEST(FrameIds, TakesACameraThatBeginsAgainForNoLoss) {
  FrameIds ids;
  EXPECT_EQ(ids.note(500), 0u);
  EXPECT_EQ(ids.note(1), 0u);
  EXPECT_EQ(ids.note(2), 0u);
}

}  // namespace
}  // namespace slsd
