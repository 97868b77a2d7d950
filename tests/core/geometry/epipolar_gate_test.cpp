// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/epipolar/epipolar_gate.hpp"

#include <span>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/geometry/triangulate.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

constexpr double kMinMm = 400.0, kMaxMm = 2500.0;

Eigen::Vector2d projector_direction(const Calibration& rig, const Eigen::Vector3d& point) {
  return (rig.cameras[0].projector_from_camera * point).hnormalized();
}

struct Compared {
  float residual_px, disparity;
};

Compared compare(const EpipolarGate& gate, const Eigen::Vector2d& seen, const Eigen::Vector2d& lit) {
  RayPairs one;
  one.camera_x[0] = seen.x(), one.camera_y[0] = seen.y();
  one.projector_x[0] = lit.x(), one.projector_y[0] = lit.y();
  Compared compared{};
  gate.compare(one, std::span(&compared.residual_px, 1), std::span(&compared.disparity, 1));
  return compared;
}

RC_GTEST_PROP(EpipolarGate, PassesEveryPointWithinTheWorkingDepth, ()) {
  const Calibration rig = paper_rig();
  const EpipolarGate gate(rig.cameras[0], rig.projector, kMinMm, kMaxMm);
  const Eigen::Vector3d point = any_point(rig.cameras[0].lens, kMinMm + 0.1, kMaxMm - 0.1);
  const EpipolarSegment segment = gate.prepare(point.hnormalized());
  const Eigen::Vector2d direction = projector_direction(rig, point);
  RC_ASSERT(std::abs(segment.residual_px(direction)) < 1e-9);
  RC_ASSERT(segment.passes(direction, 1e-6));
}

RC_GTEST_PROP(EpipolarGate, StopsEveryPointBeyondTheWorkingDepth, ()) {
  const Calibration rig = paper_rig();
  const EpipolarGate gate(rig.cameras[0], rig.projector, kMinMm, kMaxMm);
  const Eigen::Vector2d camera = rig.cameras[0].lens.undistort(any_pixel(rig.cameras[0].lens));
  const EpipolarSegment segment = gate.prepare(camera);
  const auto passes = [&](double depth) {
    return segment.passes(projector_direction(rig, depth * camera.homogeneous()), 1.0);
  };
  RC_ASSERT(!passes(kMinMm - uniform(0.01, 300)));
  RC_ASSERT(!passes(kMaxMm + uniform(0.01, 100000)));
  RC_ASSERT(passes(kMinMm + 0.01));
  RC_ASSERT(passes(kMaxMm - 0.01));
}

// Negative between the ends; beyond them, as many pixels as the direction lies from the end.
RC_GTEST_PROP(EpipolarGate, MeasuresHowFarAPointLiesOutside, ()) {
  const Calibration rig = paper_rig();
  const EpipolarGate gate(rig.cameras[0], rig.projector, kMinMm, kMaxMm);
  const Eigen::Vector2d camera = rig.cameras[0].lens.undistort(any_pixel(rig.cameras[0].lens));
  const EpipolarSegment segment = gate.prepare(camera);
  const auto direction = [&](double depth) { return projector_direction(rig, depth * camera.homogeneous()); };
  const auto distance_px = [&](double depth, double end) {
    return ((direction(depth) - direction(end)).array() * Eigen::Array2d(rig.projector.fx, rig.projector.fy))
        .matrix()
        .norm();
  };
  const double near = kMinMm - uniform(0.01, 100), far = kMaxMm + uniform(0.01, 100000);
  RC_ASSERT(segment.outside_px(direction(uniform(kMinMm + 0.01, kMaxMm - 0.01))) < 0);
  RC_ASSERT(std::abs(segment.outside_px(direction(near)) - distance_px(near, kMinMm)) < 1e-6);
  RC_ASSERT(std::abs(segment.outside_px(direction(far)) - distance_px(far, kMaxMm)) < 1e-6);
}

RC_GTEST_PROP(EpipolarGate, ResidualIsThatOfTriangulateToAFewPercent, ()) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const EpipolarGate gate(camera, rig.projector, kMinMm, kMaxMm);
  const Match match{any_pixel(camera.lens), any_pixel(rig.projector)};
  const double exact = epipolar_residual_px(match, camera, rig.projector);
  const double quick = std::abs(
      gate.prepare(camera.lens.undistort(match.camera_px)).residual_px(rig.projector.undistort(match.projector_px)));
  RC_ASSERT(std::abs(quick - exact) < 0.05 * exact + 1e-9);
}

RC_GTEST_PROP(EpipolarGate, MeasuresAResidualWithoutASegmentToo, ()) {
  const Calibration rig = paper_rig();
  const EpipolarGate gate(rig.cameras[0], rig.projector, kMinMm, kMaxMm);
  const Eigen::Vector2d seen = rig.cameras[0].lens.undistort(any_pixel(rig.cameras[0].lens)),
                        lit = rig.projector.undistort(any_pixel(rig.projector));
  const double by_segment = gate.prepare(seen).residual_px(lit);
  RC_ASSERT(std::abs(compare(gate, seen, lit).residual_px - by_segment) < 1e-6 * std::abs(by_segment) + 1e-6);
}

RC_GTEST_PROP(EpipolarGate, DisparityIsTheBaselineOverTheDepth, ()) {
  const Calibration rig = paper_rig();
  const RigidTransform& projector_from_camera = rig.cameras[0].projector_from_camera;
  const EpipolarGate gate(rig.cameras[0], rig.projector, kMinMm, kMaxMm);
  const Eigen::Vector3d point = any_point(rig.cameras[0].lens, kMinMm, kMaxMm);
  const Eigen::Vector2d seen = point.hnormalized(), lit = projector_direction(rig, point);
  const double exact = projector_from_camera.translation.norm() / point.z();
  RC_ASSERT(std::abs(compare(gate, seen, lit).disparity - exact) < 1e-7 * exact);
  // What lies across the line of this ray does not change it.
  const Eigen::Vector3d line =
      projector_from_camera.translation.cross(projector_from_camera.rotation * seen.homogeneous());
  const Eigen::Vector2d across = 0.01 * line.head<2>().normalized();
  RC_ASSERT(std::abs(compare(gate, seen, lit + across).disparity - exact) < 1e-7 * exact);
}

TEST(EpipolarGate, CutsWhatLiesBehindTheProjector) {
  Calibration rig = paper_rig();
  rig.cameras[0].projector_from_camera = {Eigen::Matrix3d::Identity(), {-180, 0, -1000}};
  const EpipolarGate gate(rig.cameras[0], rig.projector, kMinMm, kMaxMm);
  const EpipolarSegment segment = gate.prepare({0.1, 0.05});
  EXPECT_FALSE(segment.empty());
  EXPECT_TRUE(segment.passes(projector_direction(rig, 2000 * Eigen::Vector3d(0.1, 0.05, 1)), 0.1));
  EXPECT_FALSE(segment.passes(projector_direction(rig, 500 * Eigen::Vector3d(0.1, 0.05, 1)), 0.1));
  EXPECT_TRUE(EpipolarGate(rig.cameras[0], rig.projector, 400, 900).prepare({0.1, 0.05}).empty());
}

TEST(EpipolarGate, PassesNothingOnTheRayThroughTheProjector) {
  Calibration rig = paper_rig();
  rig.cameras[0].projector_from_camera = {Eigen::Matrix3d::Identity(), {0, 0, -100}};
  const EpipolarSegment segment = EpipolarGate(rig.cameras[0], rig.projector, 400, 900).prepare({0, 0});
  EXPECT_TRUE(segment.empty());
  EXPECT_FALSE(segment.passes({0, 0}, 1e9));
}

}  // namespace
}  // namespace slsd
