// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>

#include "bumpy_ball.hpp"
#include "clients/model/places/align.hpp"
#include "clients/model/places/track.hpp"

namespace slsd::model {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

RigidTransform object_from_rig_of(const RigidTransform& before, const RigidTransform& now) {
  return before.after(now.inverse());
}

/// Lays the object as it is after a motion onto how it was before, from a start without motion.
std::optional<Alignment> aligned(const Distance& distance, const RigidTransform& before, const RigidTransform& now) {
  const Shot reference = shot_of(distance, before, 0.05F, 1), shot = shot_of(distance, now, 0.05F, 2);
  const PlacedShot placed{&reference, {}};
  return align(shot, {&placed, 1}, {});
}

TEST(Align, FindsAMotion) {
  const RigidTransform before = rig_from_object(0), now = rig_from_object(8, 2, {1, -2, 3});
  const auto found = aligned(bumpy_ball, before, now);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(refusal_of(*found), "");
  const RigidTransform off = found->object_from_rig.after(object_from_rig_of(before, now).inverse());
  EXPECT_LT(apart_mm(off.after(before), before), 0.08);
  EXPECT_GT(found->overlap, 0.7);
  EXPECT_NEAR(found->fit, 1, 0.3);
}

TEST(Align, NamesTheTurnOfABall) {
  const auto found = aligned(smooth_ball, rig_from_object(0), rig_from_object(5));
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->determined, 0.002);
  EXPECT_TRUE(found->least_determined.turns);
  // The axis leads through the ball's middle.
  const Eigen::Vector3d off = kMiddle - found->least_determined.through_mm;
  EXPECT_LT(off.cross(found->least_determined.axis).norm(), 5);
  EXPECT_THAT(refusal_of(*found), StartsWith("the surface has too little relief to determine turning about"));
}

TEST(Align, NamesTheAxisOfACylinder) {
  const auto found = aligned(cylinder, rig_from_object(0), rig_from_object(5));
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->determined, 0.002);
  EXPECT_THAT(refusal_of(*found), HasSubstr("too little relief to determine"));
  EXPECT_GT(std::abs(found->least_determined.axis.y()), 0.95);
}

TEST(Align, RefusesAnotherObject) {
  const Shot reference = shot_of(bumpy_ball, rig_from_object(0), 0.05F, 1),
             other = shot_of(bumpy_ball, rig_from_object(180), 0.05F, 2);
  const PlacedShot placed{&reference, {}};
  const auto found = align(other, {&placed, 1}, {});
  EXPECT_TRUE(!found || !refusal_of(*found).empty());
}

TEST(Tracker, FollowsTurnsAndFindsTheObjectAgain) {
  Tracker tracker;
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(tracker.add(i, shot_of(bumpy_ball, rig_from_object(8 * i), 0.05F, i)).refusal, "");
  EXPECT_THAT(tracker.add(4, shot_of(bumpy_ball, rig_from_object(160), 0.05F, 9)).refusal, testing::Not(""));
  EXPECT_THAT(tracker.add(5, Shot{}).refusal, StartsWith("it shows almost nothing"));
  const Tracked again = tracker.add(6, shot_of(bumpy_ball, rig_from_object(30, 0, {20, 0, 0}), 0.05F, 10));
  EXPECT_EQ(again.refusal, "");
  EXPECT_TRUE(again.found_again);
  ASSERT_EQ(tracker.frames().size(), 5);
  const RigidTransform truth = object_from_rig_of(rig_from_object(0), rig_from_object(30, 0, {20, 0, 0}));
  const RigidTransform off = tracker.frames().back().object_from_rig.after(truth.inverse());
  EXPECT_LT(apart_mm(off.after(rig_from_object(0)), rig_from_object(0)), 0.1);
}

TEST(Tracker, RefusesToBeginWithABall) {
  Tracker tracker;
  EXPECT_THAT(tracker.add(0, shot_of(smooth_ball, rig_from_object(0), 0.05F, 1)).refusal,
              HasSubstr("too little relief"));
  EXPECT_TRUE(tracker.frames().empty());
}

}  // namespace
}  // namespace slsd::model
