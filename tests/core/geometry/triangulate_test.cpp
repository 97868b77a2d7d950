// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulate.hpp"

#include <span>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <opencv2/calib3d.hpp>

#include "core/geometry/ray_table.hpp"
#include "core/geometry/triangulator.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

struct Seen {
  Eigen::Vector3d point;
  Match match;
};

Seen any_seen(const Calibration& rig) {
  const CalibratedCamera& camera = rig.cameras[0];
  const Eigen::Vector3d point = any_point(camera.lens);
  return {point, {camera.lens.project(point), rig.projector.project(camera.projector_from_camera * point)}};
}

Match with_noise(Match match, double range_px) {
  match.camera_px += Eigen::Vector2d(uniform(-range_px, range_px), uniform(-range_px, range_px));
  match.projector_px += Eigen::Vector2d(uniform(-range_px, range_px), uniform(-range_px, range_px));
  return match;
}

cv::Mat opencv_matrix(const Lens& lens) {
  return (cv::Mat_<double>(3, 3) << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
}

Eigen::Vector3d by_opencv(const Match& match, const CalibratedCamera& camera, const Lens& projector) {
  const auto undistorted = [](const Lens& lens, const Eigen::Vector2d& pixel) {
    std::vector<cv::Point2d> in{{pixel.x(), pixel.y()}}, out;
    const std::vector<double> distortion(lens.distortion.begin(), lens.distortion.end());
    cv::undistortPoints(in, out, opencv_matrix(lens), distortion, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-15));
    return out;
  };
  cv::Mat left = cv::Mat::eye(3, 4, CV_64F), right(3, 4, CV_64F), point;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      right.at<double>(row, column) = camera.projector_from_camera.rotation(row, column);
    }
    right.at<double>(row, 3) = camera.projector_from_camera.translation[row];
  }
  cv::triangulatePoints(left, right, undistorted(camera.lens, match.camera_px),
                        undistorted(projector, match.projector_px), point);
  const double w = point.at<double>(3);
  return Eigen::Vector3d(point.at<double>(0), point.at<double>(1), point.at<double>(2)) / w;
}

RC_GTEST_PROP(Triangulate, ReturnsTheProjectedPoint, ()) {
  const Calibration rig = paper_rig();
  const Seen seen = any_seen(rig);
  const auto found = triangulate(seen.match, rig.cameras[0], rig.projector, 0.1);
  RC_ASSERT((found.point_in_camera - seen.point).norm() < 1e-6);
  RC_ASSERT(epipolar_residual_px(seen.match, rig.cameras[0], rig.projector) < 1e-7);
}

RC_GTEST_PROP(Triangulate, AgreesWithOpenCv, ()) {
  const Calibration rig = paper_rig();
  const Match match = any_seen(rig).match;
  const auto found = triangulate(match, rig.cameras[0], rig.projector, 0.1);
  RC_ASSERT((found.point_in_camera - by_opencv(match, rig.cameras[0], rig.projector)).norm() < 1e-4);
}

RC_GTEST_PROP(Triangulate, SigmaIsTheSlopeAlongTheRay, ()) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const Match match = with_noise(any_seen(rig).match, 0.5);
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
  const Match match = with_noise(any_seen(rig).match, 1.0);
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
  const Match match = with_noise(any_seen(rig).match, 2.0);
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
