// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>

#include "bumpy_ball.hpp"
#include "clients/model/places/adjust.hpp"

namespace slsd::model {
namespace {

RigidTransform truth(double degrees) {
  return rig_from_object(0).after(rig_from_object(degrees).inverse());
}

/// Frames all the way round, whose turns have an error that adds up.
std::vector<ModelFrame> drifting(int count, double drift_degrees) {
  std::vector<ModelFrame> frames;
  for (int i = 0; i < count; ++i) {
    const double degrees = 360.0 * i / count;
    frames.push_back({static_cast<std::size_t>(i),
                      shot_of(bumpy_ball, rig_from_object(degrees), 0.05F, static_cast<unsigned>(i)),
                      truth(degrees + drift_degrees * i / count)});
  }
  return frames;
}

double worst_mm(const std::vector<ModelFrame>& frames) {
  double worst = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const RigidTransform now = rig_from_object(360.0 * static_cast<double>(i) / static_cast<double>(frames.size()));
    worst = std::max(worst, apart_mm(frames[i].object_from_rig.after(now), rig_from_object(0)));
  }
  return worst;
}

TEST(Adjust, ClosesTheCircle) {
  std::vector<ModelFrame> frames = drifting(24, 1);
  ASSERT_GT(worst_mm(frames), 0.8);
  const Adjustment done = adjust(frames);
  EXPECT_TRUE(done.closed);
  EXPECT_NEAR(done.drift_mm, 0.7, 0.35);  // a degree at 50 mm, seen from the front
  EXPECT_LT(done.seam_mm, 0.02);
  EXPECT_NEAR(done.over_sigma, 1, 0.3);
  EXPECT_LT(worst_mm(frames), 0.15);
}

TEST(Adjust, SaysThatHalfACircleIsOpen) {
  std::vector<ModelFrame> frames = drifting(24, 0);
  frames.resize(12);
  const Adjustment done = adjust(frames);
  EXPECT_FALSE(done.closed);
  EXPECT_GT(done.links, 11);
}

TEST(Adjust, KeepsTheFirstFrame) {
  std::vector<ModelFrame> frames = drifting(24, 1);
  frames.resize(3);
  static_cast<void>(adjust(frames));
  EXPECT_EQ(frames[0].object_from_rig.translation, truth(0).translation);
  static_cast<void>(adjust({}));
}

TEST(Adjust, KnowsNoFitOfAFrameThatMeetsNoOther) {
  std::vector<ModelFrame> frames = drifting(24, 0);
  frames.resize(3);
  frames[2].object_from_rig.translation.x() += 400;
  const Adjustment done = adjust(frames);
  ASSERT_EQ(done.fit.size(), 3U);
  EXPECT_TRUE(done.fit[0] && done.fit[1]);
  EXPECT_FALSE(done.fit[2]);
}

}  // namespace
}  // namespace slsd::model
