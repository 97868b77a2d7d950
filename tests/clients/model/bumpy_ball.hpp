// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "clients/model/places/shot.hpp"
#include "clients/model/range_image.hpp"

namespace slsd::model {

/// Signed distance to a surface, mm, in the object's frame; at most the true one, so that rays can step by it.
using Distance = std::function<float(const Eigen::Vector3f&)>;

/// A ball of 50 mm with bumps of up to 5 mm, no two of which look alike.
inline float bumpy_ball(const Eigen::Vector3f& at) {
  const float bumps = std::sin(0.07F * at.x() + 1) * std::sin(0.09F * at.y()) + 0.6F * std::sin(0.11F * at.z() + 2) +
                      0.4F * std::sin(0.15F * at.x() - 0.05F * at.z()) * std::cos(0.13F * at.y() + 1);
  return 0.7F * (at.norm() - 50 - 2.5F * bumps);
}

inline float smooth_ball(const Eigen::Vector3f& at) {
  return at.norm() - 50;
}

/// Upright, without ends in view.
inline float cylinder(const Eigen::Vector3f& at) {
  return Eigen::Vector2f(at.x(), at.z()).norm() - 45;
}

/// A camera 600 mm before the object's middle, which it sees as 130 mm wide.
inline Calibration test_calibration() {
  Calibration calibration;
  CalibratedCamera camera;
  camera.name = "camera";
  camera.lens = {.width_px = 400, .height_px = 320, .fx = 1800, .fy = 1800, .cx = 199.5, .cy = 159.5};
  camera.projector_from_camera.translation = {-100, 0, 0};
  calibration.cameras.push_back(camera);
  calibration.projector = {.width_px = 800, .height_px = 500, .fx = 1500, .fy = 1500, .cx = 650, .cy = 250};
  return calibration;
}

inline const Eigen::Vector3d kMiddle(0, 0, 600);

/// The object's place in a frame: turned about the upright axis, then tilted and moved.
inline RigidTransform rig_from_object(double turn_degrees, double tilt_degrees = 0,
                                      const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
  constexpr double kDegree = 3.14159265358979 / 180;
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(tilt_degrees * kDegree, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(turn_degrees * kDegree, Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
  return {rotation, kMiddle + shift};
}

/// A scan of the object. The errors along the rays have `sigma_mm` and are alike over some pixels, as those of dense
/// clouds.
inline std::vector<DensePoint> measure(const Distance& distance, const RigidTransform& rig_from_object, float sigma_mm,
                                       unsigned seed, const Lens& lens = test_calibration().cameras[0].lens) {
  constexpr int kAlikePx = 6;
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  const int columns = lens.width_px / kAlikePx + 2;
  std::vector<float> errors(static_cast<std::size_t>(columns) * (lens.height_px / kAlikePx + 2));
  for (float& error : errors) error = normal(random);
  const auto error_at = [&](int x, int y) {  // of variance one everywhere
    const float right = static_cast<float>(x % kAlikePx) / kAlikePx,
                below = static_cast<float>(y % kAlikePx) / kAlikePx;
    const float weights[4] = {(1 - right) * (1 - below), right * (1 - below), (1 - right) * below, right * below};
    const float* from = &errors[static_cast<std::size_t>(y / kAlikePx) * columns + x / kAlikePx];
    const float values[4] = {from[0], from[1], from[columns], from[columns + 1]};
    float sum = 0, squares = 0;
    for (int i = 0; i < 4; ++i) sum += weights[i] * values[i], squares += weights[i] * weights[i];
    return sum / std::sqrt(squares);
  };
  const RigidTransform object_from_rig = rig_from_object.inverse();
  const Eigen::Matrix3f rotation = object_from_rig.rotation.cast<float>();
  const Eigen::Vector3f camera = object_from_rig.translation.cast<float>();
  std::vector<DensePoint> points;
  for (int y = 0; y < lens.height_px; ++y) {
    for (int x = 0; x < lens.width_px; ++x) {
      const Eigen::Vector3d ray = lens.undistort(Eigen::Vector2d(x, y)).homogeneous().normalized();
      const Eigen::Vector3f along = rotation * ray.cast<float>();
      float far = 500;
      for (int step = 0; step < 100; ++step) {
        const float left = distance(camera + far * along);
        far += left;
        if (left < 1e-4F || far > 720) break;
      }
      if (far > 720) continue;
      points.push_back({(ray * (far + sigma_mm * error_at(x, y))).cast<float>(), sigma_mm, 100, 0});
    }
  }
  return points;
}

inline Shot shot_of(const Distance& distance, const RigidTransform& rig_from_object, float sigma_mm, unsigned seed) {
  return make_shot(*range_images(measure(distance, rig_from_object, sigma_mm, seed), test_calibration(), std::nullopt));
}

/// The largest distance between a place of the object in one pose and in the other, at its surface.
inline double apart_mm(const RigidTransform& a, const RigidTransform& b) {
  double most = 0;
  for (const Eigen::Vector3d& place :
       {Eigen::Vector3d(50, 0, 0), {-50, 0, 0}, {0, 50, 0}, {0, -50, 0}, {0, 0, 50}, {0, 0, -50}})
    most = std::max(most, (a * place - b * place).norm());
  return most;
}

}  // namespace slsd::model
