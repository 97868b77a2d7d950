// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <string>

#include <gmock/gmock.h>

#include "clients/model/places/track.hpp"
#include "hand.hpp"

namespace slsd::model {
namespace {

using testing::HasSubstr;

/// Two bumpy balls of 30 mm beside each other, turned by different angles about their own upright axes.
Distance pair(float left_degrees, float right_degrees) {
  const Eigen::Matrix3f left = turned(-left_degrees), right = turned(-right_degrees);
  return [left, right](const Eigen::Vector3f& at) {
    constexpr float kSize = 0.6F;
    const Eigen::Vector3f beside(40, 0, 0);
    return kSize *
           std::min(bumpy_ball(left * (at + beside) / kSize), bumpy_ball(turned(90) * right * (at - beside) / kSize));
  };
}

Shot shot_of_pair(float left_degrees, float right_degrees, double both_degrees, unsigned seed) {
  const Calibration calibration = wide_calibration();
  return make_shot(*range_images(measure(pair(left_degrees, right_degrees), rig_from_object(both_degrees), 0.05F, seed,
                                         calibration.cameras[0].lens),
                                 calibration, std::nullopt));
}

TEST(TwoBodies, AreRefusedIfOneStandsStill) {
  Tracker tracker;
  EXPECT_EQ(tracker.add(0, shot_of_pair(0, 0, 0, 1)).refusal, "");
  for (unsigned i = 1; i < 4; ++i)
    EXPECT_THAT(tracker.add(i, shot_of_pair(0, 10.0F * static_cast<float>(i), 0, i)).refusal,
                HasSubstr("two bodies in view move differently"));
  EXPECT_EQ(tracker.frames().size(), 1U);
}

TEST(TwoBodies, AreRefusedIfTheyTurnAgainstEachOther) {
  Tracker tracker;
  EXPECT_EQ(tracker.add(0, shot_of_pair(0, 0, 0, 1)).refusal, "");
  for (unsigned i = 1; i < 6; ++i) {
    const float degrees = 8 * static_cast<float>(i);
    EXPECT_THAT(tracker.add(i, shot_of_pair(degrees, -degrees, 0, i)).refusal,
                HasSubstr("two bodies in view move differently"));
  }
  EXPECT_EQ(tracker.frames().size(), 1U);
}

TEST(TwoBodies, AreToldOnceSlowOnesAreApart) {
  Tracker tracker;
  EXPECT_EQ(tracker.add(0, shot_of_pair(0, 0, 0, 1)).refusal, "");
  for (unsigned i = 1; i < 7; ++i) {
    const float degrees = 4 * static_cast<float>(i);
    const std::string refusal = tracker.add(i, shot_of_pair(degrees, -degrees, 0, i)).refusal;
    EXPECT_NE(refusal, "");
    if (i > 2) {
      EXPECT_THAT(refusal, HasSubstr("two bodies in view move differently")) << i;
    }
  }
}

TEST(TwoBodies, AreRefusedWhenOneBeginsToMove) {
  Tracker tracker;
  for (unsigned i = 0; i < 3; ++i) EXPECT_EQ(tracker.add(i, shot_of_pair(0, 0, 4 * i, i)).refusal, "");
  EXPECT_THAT(tracker.add(3, shot_of_pair(0, 12, 8, 3)).refusal, HasSubstr("--background or --box"));
  EXPECT_THAT(tracker.add(4, shot_of_pair(0, 24, 8, 4)).refusal, HasSubstr("--background or --box"));
  EXPECT_EQ(tracker.frames().size(), 3U);
}

TEST(TwoBodies, AreOneIfTheyMoveTogether) {
  Tracker tracker;
  for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(tracker.add(i, shot_of_pair(0, 0, 8 * i, i)).refusal, "");
}

}  // namespace
}  // namespace slsd::model
