// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Lenses and points as OpenCV's calib3d computes them.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <opencv2/calib3d.hpp>

#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

RC_GTEST_PROP(Project, AgreesWithOpenCv, ()) {
  const Lens lens = any_distorted_lens();
  const Eigen::Vector3d point(uniform(-500, 500), uniform(-400, 400), uniform(1500, 2500));
  const cv::Matx33d pinhole(lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
  std::vector<cv::Point2d> seen;
  cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(), cv::Vec3d(), pinhole,
                    std::vector<double>(lens.distortion.begin(), lens.distortion.end()), seen);
  RC_ASSERT((lens.project(point) - Eigen::Vector2d(seen[0].x, seen[0].y)).norm() < 1e-9);
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

RC_GTEST_PROP(Triangulate, AgreesWithOpenCv, ()) {
  const Calibration rig = paper_rig();
  const Match match = any_point_and_match(rig).match;
  const auto found = triangulate(match, rig.cameras[0], rig.projector, 0.1);
  RC_ASSERT((found.point_in_camera - by_opencv(match, rig.cameras[0], rig.projector)).norm() < 1e-4);
}

}  // namespace
}  // namespace slsd
