// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gmock/gmock.h>

#include "clients/model/places/adjust.hpp"
#include "clients/model/places/align.hpp"
#include "clients/model/places/surface_edges.hpp"
#include "clients/model/places/track.hpp"
#include "hand.hpp"
#include "plates.hpp"

namespace slsd::model {
namespace {

constexpr float kPixelMm = 600.0F / 1800, kSigmaMm = 0.05F;

const std::vector<SurfaceEdge>& edges_of(const Shot& shot) {
  return shot.views[0].edges.edges;
}

/// Distance of a place on the front of the plate from its nearest side; negative outside.
float inside_mm(const Eigen::Vector3f& in_rig) {
  const Eigen::Vector3f at = in_rig - kMiddle.cast<float>();
  return std::min(kPlateHalfMm.x() - std::abs(at.x()), kPlateHalfMm.y() - std::abs(at.y()));
}

TEST(SurfaceEdges, LieAroundAPlate) {
  const Shot shot = eroded_shot_of(plate, rig_from_object(0), kSigmaMm, 1);
  const double around_px = 4 * (kPlateHalfMm.x() + kPlateHalfMm.y()) / kPixelMm;
  EXPECT_GT(static_cast<double>(edges_of(shot).size()), 0.7 * around_px / kCellSteps.back());
  for (const SurfaceEdge& edge : edges_of(shot)) {
    EXPECT_NEAR(inside_mm(edge.place_mm), 0, 0.7 * kPixelMm);
    EXPECT_LT(inside_mm(edge.place_mm + 5 * edge.across), -4);
    EXPECT_LT(edge.normal.z(), -0.99F);
    EXPECT_NEAR(edge.sigma_mm, 2 * kPixelMm, 0.1F);
  }
}

TEST(SurfaceEdges, HaveTheWidthOfAPixelOnAnObliqueSurface) {
  const Shot shot = eroded_shot_of(plate, rig_from_object(50), kSigmaMm, 1);
  std::size_t upright = 0;
  for (const SurfaceEdge& edge : edges_of(shot)) {
    if (std::abs(edge.across.y()) > 0.3F) continue;
    ++upright;
    EXPECT_NEAR(edge.sigma_mm, 2 * kPixelMm / std::cos(50 * 3.14159F / 180), 0.2F);
  }
  EXPECT_GT(upright, 10);
}

TEST(SurfaceEdges, AreNotLookedForInAShotToFuse) {
  const Shot shot =
      make_shot_to_fuse(*range_images(measure_eroded(plate, rig_from_object(0), kSigmaMm, 1), test_calibration(), {}));
  EXPECT_THAT(edges_of(shot), testing::IsEmpty());
  EXPECT_EQ(shot.views[0].edges.of(0), nullptr);
  EXPECT_EQ(shot.cells(), eroded_shot_of(plate, rig_from_object(0), kSigmaMm, 1).cells());
}

TEST(SurfaceEdges, AreNotWhereARoundSurfaceBendsAway) {
  EXPECT_THAT(edges_of(eroded_shot_of(smooth_ball, rig_from_object(0), kSigmaMm, 1)), testing::IsEmpty());
  for (const float radius_mm : {5.0F, 8.0F, 15.0F, 25.0F, 40.0F}) {
    const auto bar = [&](const Eigen::Vector3f& at) { return rod(at, {0, -20, 0}, {0, 20, 0}, radius_mm); };
    EXPECT_LT(edges_of(eroded_shot_of(bar, rig_from_object(0), kSigmaMm, 1)).size(), 9)
        << radius_mm;  // of some 60 to 120
  }
}

TEST(SurfaceEdges, AreNotWhereTheViewEnds) {
  const auto wall = [](const Eigen::Vector3f& at) { return block(at, {200, 200, 4}); };
  EXPECT_THAT(edges_of(eroded_shot_of(wall, rig_from_object(0), kSigmaMm, 1)), testing::IsEmpty());
}

TEST(SurfaceEdges, AreNotWhereTheBoxEnds) {
  const Box box(Eigen::Vector3f(-20, -100, 0), Eigen::Vector3f(100, 100, 1000));
  const Shot shot = eroded_shot_of(plate, rig_from_object(0), kSigmaMm, 1, box);
  EXPECT_GT(edges_of(shot).size(), 50);
  for (const SurfaceEdge& edge : edges_of(shot)) EXPECT_GT(edge.place_mm.x(), -18);
}

TEST(SurfaceEdges, AreNotWhereTheLightEnds) {
  Calibration calibration = test_calibration();
  calibration.projector.width_px /= 2;
  const Shot whole = eroded_shot_of(plate, rig_from_object(0), kSigmaMm, 1);
  const Shot shot = eroded_shot_of(plate, rig_from_object(0), kSigmaMm, 1, {}, calibration);
  EXPECT_GT(edges_of(shot).size(), 0);
  EXPECT_LT(edges_of(shot).size(), 0.8 * static_cast<double>(edges_of(whole).size()));
  for (const SurfaceEdge& edge : edges_of(shot)) {
    const Eigen::Vector3d in_projector = calibration.cameras[0].projector_from_camera * edge.place_mm.cast<double>();
    EXPECT_LT(calibration.projector.project(in_projector).x(), calibration.projector.width_px);
  }
}

TEST(SurfaceEdges, AreNotWhereANearerSurfaceHidesTheRest) {
  // A bar before the plate, with a gap in the measurement on both sides of it.
  const auto both = [](const Eigen::Vector3f& at) {
    return std::min(plate(at), block(at - Eigen::Vector3f(0, 0, -30), {5, 60, 2}));
  };
  const Shot shot = eroded_shot_of(both, rig_from_object(0), kSigmaMm, 1);
  for (const SurfaceEdge& edge : edges_of(shot)) {
    const bool is_upright = std::abs(edge.across.x()) > 0.5F;
    if (is_upright && edge.place_mm.z() > 590) {
      EXPECT_GT(std::abs(edge.place_mm.x()), 30);
    }
  }
}

TEST(SurfaceEdges, AreNotAroundAGapInTheMeasurement) {
  std::vector<DensePoint> points = measure_eroded(plate, rig_from_object(0), kSigmaMm, 1);
  std::erase_if(points, [](const DensePoint& point) { return point.place_mm.head<2>().norm() < 4; });
  const Shot shot = make_shot(*range_images(points, test_calibration(), std::nullopt));
  for (const SurfaceEdge& edge : edges_of(shot)) EXPECT_GT(edge.place_mm.head<2>().norm(), 20);
}

TEST(Align, EdgesHoldAPlateThatCouldSlide) {
  const RigidTransform before = rig_from_object(0), now = rig_from_object(4, 1, {3, -4, 0.5});
  const Shot reference = eroded_shot_of(plate, before, 0.2F, 1), shot = eroded_shot_of(plate, now, 0.2F, 2);
  const PlacedShot placed{&reference, {}};
  const auto found = align(shot, {&placed, 1}, {});
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(refusal_of(*found), "");
  const RigidTransform off = found->object_from_rig.after(now.after(before.inverse()));
  EXPECT_LT(apart_mm(off.after(before), before), 0.5);
}

TEST(Align, NoiseOfTheNormalsIsNoRelief) {
  const auto wall = [](const Eigen::Vector3f& at) { return block(at, {200, 200, 4}); };
  const Shot reference = eroded_shot_of(wall, rig_from_object(0), 0.5F, 1),
             shot = eroded_shot_of(wall, rig_from_object(2), 0.5F, 2);
  const PlacedShot placed{&reference, {}};
  const auto found = align(shot, {&placed, 1}, {});
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->determined, 0.001);
  EXPECT_THAT(refusal_of(*found), testing::HasSubstr("too little relief"));
}

RigidTransform turning(std::size_t frame) {
  const double number = static_cast<double>(frame);
  return rig_from_object(10 * number, 2 * std::sin(number), {2 * std::cos(number), std::sin(2 * number), 0});
}

TEST(Align, ASlabSeenObliquelyIsNotCertainEnough) {
  // Its upright edges are too oblique to be used, and the others hold it in one direction alone.
  const RigidTransform before = rig_from_object(66), now = rig_from_object(70, 0, {2, 0, 0});
  const Shot reference = eroded_shot_of(plate, before, 0.4F, 1), shot = eroded_shot_of(plate, now, 0.4F, 2);
  const PlacedShot placed{&reference, {}};
  const auto found = align(shot, {&placed, 1}, {});
  EXPECT_TRUE(!found || !refusal_of(*found).empty());
  const Shot front = eroded_shot_of(plate, rig_from_object(0), 0.4F, 1),
             next = eroded_shot_of(plate, rig_from_object(4), 0.4F, 2);
  const PlacedShot placed_front{&front, {}};
  const auto held = align(next, {&placed_front, 1}, {});
  ASSERT_TRUE(held.has_value());
  EXPECT_EQ(refusal_of(*held), "");
  EXPECT_LT(held->uncertain_px, 2);
}

TEST(Tracker, FollowsThinPlatesAllTheWayRound) {
  Tracker tracker;
  for (std::size_t i = 0; i < 36; ++i) {
    const Shot shot = eroded_shot_of(bracket, turning(i), 0.1F, static_cast<unsigned>(i));
    EXPECT_EQ(tracker.add(i, shot).refusal, "") << i;
  }
  EXPECT_TRUE(adjust(tracker.frames()).closed);
  for (const ModelFrame& frame : tracker.frames())
    EXPECT_LT(apart_mm(frame.object_from_rig.after(turning(frame.number)), turning(0)), 1.2) << frame.number;
}

TEST(Tracker, TakesNoOtherSideForTheOneBefore) {
  // Lost at its front, the bracket comes back with its rear, whose wall looks like that of the front.
  Tracker tracker;
  for (std::size_t i = 0; i < 4; ++i)
    ASSERT_EQ(tracker.add(i, eroded_shot_of(bracket, turning(i), 0.1F, static_cast<unsigned>(i))).refusal, "");
  for (std::size_t i = 15; i < 22; ++i)
    EXPECT_NE(tracker.add(i, eroded_shot_of(bracket, turning(i), 0.1F, static_cast<unsigned>(i))).refusal, "") << i;
}

}  // namespace
}  // namespace slsd::model
