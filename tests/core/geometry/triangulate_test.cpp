// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulate.hpp"

#include <span>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/geometry/ray_table.hpp"
#include "core/geometry/triangulator.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

Match with_noise(Match match, double range_px) {
  match.camera_px += Eigen::Vector2d(uniform(-range_px, range_px), uniform(-range_px, range_px));
  match.projector_px += Eigen::Vector2d(uniform(-range_px, range_px), uniform(-range_px, range_px));
  return match;
}

RC_GTEST_PROP(Triangulate, ReturnsTheProjectedPoint, ()) {
  const Calibration rig = paper_rig();
  const PointAndMatch seen = any_point_and_match(rig);
  const auto found = triangulate(seen.match, rig.cameras[0], rig.projector, 0.1);
  RC_ASSERT((found.point_in_camera - seen.point).norm() < 1e-6);
  RC_ASSERT(epipolar_residual_px(seen.match, rig.cameras[0], rig.projector) < 1e-7);
}

RC_GTEST_PROP(Triangulate, SigmaIsTheSlopeAlongTheRay, ()) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const Match match = with_noise(any_point_and_match(rig).match, 0.5);
  const double sigma_px = 0.05, step_px = 1e-3;
  const Eigen::Vector3d ray = camera.lens.undistort(match.camera_px).homogeneous().normalized();
  Eigen::Vector2d slope;
  for (int axis = 0; axis < 2; ++axis) {
    Match above = match, below = match;
    above.camera_px[axis] += step_px;
    below.camera_px[axis] -= step_px;
    const Eigen::Vector3d moved = triangulate(above, camera, rig.projector, 0).point_in_camera -
                                  triangulate(below, camera, rig.projector, 0).point_in_camera;
    slope[axis] = ray.dot(moved) / (2 * step_px);
  }
  const double sigma_mm = triangulate(match, camera, rig.projector, sigma_px).sigma_mm;
  RC_ASSERT(std::abs(sigma_mm - sigma_px * slope.norm()) < 1e-5 * sigma_mm);
}

RC_GTEST_PROP(EpipolarResidual, IsTheDistanceFromTheEpipolarCurve, ()) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const Match match = with_noise(any_point_and_match(rig).match, 1.0);
  const Eigen::Vector3d ray = camera.lens.undistort(match.camera_px).homogeneous();
  const double depth = triangulate(match, camera, rig.projector, 0.1).point_in_camera.z();
  double nearest = 1e9;
  for (double z = 0.97 * depth; z < 1.03 * depth; z += 2e-5 * depth) {
    const Eigen::Vector2d curve = rig.projector.project(camera.projector_from_camera * (z * ray).eval());
    nearest = std::min(nearest, (curve - match.projector_px).norm());
  }
  RC_ASSERT(std::abs(epipolar_residual_px(match, camera, rig.projector) - nearest) < 5e-3);
}

TriangulatedPoint triangulate_one(const Triangulator& triangulator, const PixelRay& camera, const PixelRay& projector,
                                  double sigma_px) {
  RayMatches one;
  one.set(0, camera, projector.direction, sigma_px);
  TriangulatedPoint point;
  triangulator.triangulate(one, std::span(&point, 1));
  return point;
}

RC_GTEST_PROP(Triangulator, AgreesWithThePlainForm, ()) {
  const Calibration rig = paper_rig();
  const RayTable rays(rig.cameras[0].lens);
  const Triangulator triangulator(rig.cameras[0], rig.projector);
  const Match match = with_noise(any_point_and_match(rig).match, 2.0);
  const auto plain = triangulate(match, rig.cameras[0], rig.projector, 0.07);
  const auto fast =
      triangulate_one(triangulator, rays.ray(match.camera_px), pixel_ray(rig.projector, match.projector_px), 0.07);
  RC_ASSERT((plain.point_in_camera - fast.point_in_camera).norm() < 1e-4);
  RC_ASSERT(std::abs(plain.sigma_mm - fast.sigma_mm) < 1e-4 * plain.sigma_mm);
}

TEST(Triangulate, IsNotInFrontWhereRaysPart) {
  const Calibration rig = paper_rig();
  const auto in_front = [&](const TriangulatedPoint& found) { return found.point_in_camera.z() > 0; };
  const Match parting{{10, 600}, {1250, 400}};
  const Match meeting{{800, 600}, {700, 400}};
  const Triangulator fast(rig.cameras[0], rig.projector);
  for (const Match& match : {parting, meeting}) {
    const auto plain = triangulate(match, rig.cameras[0], rig.projector, 0.1);
    const auto quick = triangulate_one(fast, pixel_ray(rig.cameras[0].lens, match.camera_px),
                                       pixel_ray(rig.projector, match.projector_px), 0.1);
    EXPECT_EQ(in_front(plain), in_front(quick));
  }
  EXPECT_FALSE(in_front(triangulate(parting, rig.cameras[0], rig.projector, 0.1)));
}

}  // namespace
}  // namespace slsd
