// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <rapidcheck.h>
#include <Eigen/Geometry>

#include "core/geometry/calibration.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {

/// A rig like the paper's: 1600x1200 and 1280x800, 180 mm apart, aimed at 2 m, both lenses distorted.
inline Calibration paper_rig() {
  Calibration rig;
  rig.projector = {1280, 800, 1920.0, 1910.0, 640.25, 610.5, {-0.08, 0.05, 0.0012, -0.0007, 0.01}};
  CalibratedCamera camera;
  camera.name = "left";
  camera.lens = {1600, 1200, 2400.0, 2410.0, 790.5, 605.25, {-0.15, 0.12, -0.0008, 0.0011, -0.02}};
  camera.projector_from_camera.rotation =
      (Eigen::AngleAxisd(0.09, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  camera.projector_from_camera.translation = {-178.0, 12.0, -31.0};
  rig.cameras.push_back(camera);
  return rig;
}

inline double uniform(double low, double high) {
  return low + (high - low) * *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 1000001)) / 1000000.0;
}

/// A pixel anywhere in the lens's image.
inline Eigen::Vector2d any_pixel(const Lens& lens) {
  return {uniform(-0.5, lens.width_px - 0.5), uniform(-0.5, lens.height_px - 0.5)};
}

/// A point that the camera sees, in the camera's frame.
inline Eigen::Vector3d any_point(const Lens& lens, double depth_min_mm = 400.0, double depth_max_mm = 2500.0) {
  const Eigen::Vector2d direction = lens.undistort(any_pixel(lens));
  return uniform(depth_min_mm, depth_max_mm) * direction.homogeneous();
}

inline Lens any_distorted_lens() {
  Lens lens{1600, 1200, uniform(2000, 4000), uniform(2000, 4000), uniform(700, 900), uniform(500, 700), {}};
  lens.distortion = {uniform(-0.25, 0.25), uniform(-0.2, 0.2), uniform(-0.003, 0.003), uniform(-0.003, 0.003),
                     uniform(-0.05, 0.05)};
  return lens;
}

/// A point and its match.
struct PointAndMatch {
  Eigen::Vector3d point;
  Match match;
};

inline PointAndMatch any_point_and_match(const Calibration& rig) {
  const CalibratedCamera& camera = rig.cameras[0];
  const Eigen::Vector3d point = any_point(camera.lens);
  return {point, {camera.lens.project(point), rig.projector.project(camera.projector_from_camera * point)}};
}

}  // namespace slsd
