// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/patch_map.hpp"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace slsd {
namespace {

Eigen::Vector2f across_of(const PatchMap& map) {
  return {-map.along.y(), map.along.x()};
}

}  // namespace

PatchMap make_patch_map(const PixelRay& ray, const Eigen::Vector2d& middle_px,
                        const RigidTransform& projector_from_camera, const Lens& projector, double reference_depth_mm) {
  return make_patch_map(turned_by(ray, projector_from_camera), middle_px, projector_from_camera.translation, projector,
                        1 / reference_depth_mm);
}

Eigen::Matrix3d turned_by(const PixelRay& ray, const RigidTransform& projector_from_camera) {
  Eigen::Matrix3d turned;
  turned.leftCols<2>() = projector_from_camera.rotation.leftCols<2>() * ray.turn;
  turned.col(2) = projector_from_camera.rotation * ray.direction.homogeneous();
  return turned;
}

PatchMap make_patch_map(const Eigen::Matrix3d& turned, const Eigen::Vector2d& middle_px,
                        const Eigen::Vector3d& translation, const Lens& projector, double reference_inverse_depth) {
  PatchMap map;
  map.reference_inverse_depth = reference_inverse_depth;
  const Eigen::Vector3d middle = turned.col(2) + reference_inverse_depth * translation;
  const double scale = 1 / middle.z();
  const Eigen::Vector2d direction = scale * middle.head<2>();
  const Eigen::Vector2d pixel = projector.distort(direction);
  map.origin_px = {static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))};
  // The lens linearised around the direction, from the origin; scaled so that q2 is 1 at the centre.
  const Eigen::Matrix2d bend = projector.distort_jacobian(direction);
  const Eigen::Vector2d from_origin = pixel - map.origin_px.cast<double>();
  const auto through_lens = [&](const Eigen::Vector3d& q) {
    const Eigen::Vector2d flat = q.head<2>() - q.z() * direction;
    return Eigen::Vector3d(scale * (bend(0, 0) * flat.x() + bend(0, 1) * flat.y() + from_origin.x() * q.z()),
                           scale * (bend(1, 0) * flat.x() + bend(1, 1) * flat.y() + from_origin.y() * q.z()),
                           scale * q.z());
  };
  const Eigen::Vector3d t = through_lens(translation);
  const Eigen::Vector2d per_inverse_depth = t.head<2>() - from_origin * t.z();
  map.inverse_depth_per_px = 1 / per_inverse_depth.norm();
  map.along = (per_inverse_depth * map.inverse_depth_per_px).cast<float>();
  map.base.col(0) = through_lens(turned.col(0)).cast<float>();
  map.base.col(1) = through_lens(turned.col(1)).cast<float>();
  map.base.col(2) = Eigen::Vector3d(from_origin.x(), from_origin.y(), 1).cast<float>();
  map.shift = (t * map.inverse_depth_per_px).cast<float>();
  map.middle_px = middle_px.cast<float>();
  return map;
}

Eigen::Vector2f projector_offset(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& offset) {
  const float bend = 0.5F * (state.bend_xx * offset.x() * offset.x() + state.bend_yy * offset.y() * offset.y()) +
                     state.bend_xy * offset.x() * offset.y();
  const Eigen::Vector3f q =
      map.base * offset.homogeneous() +
      map.shift * (state.disparity + state.slope_x * offset.x() + state.slope_y * offset.y() + bend);
  return q.hnormalized() + state.across * across_of(map);
}

Eigen::Vector2f camera_offset(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& pixel) {
  // The bend moves the pixel by some hundredths: three fixed-point iterations are enough.
  const Eigen::Vector2f target = pixel - state.across * across_of(map);
  Eigen::Vector2f offset = Eigen::Vector2f::Zero();
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3f q = map.base + map.shift * Eigen::RowVector3f(state.slope_x, state.slope_y, state.disparity);
    q.col(2) +=
        map.shift * (0.5F * (state.bend_xx * offset.x() * offset.x() + state.bend_yy * offset.y() * offset.y()) +
                     state.bend_xy * offset.x() * offset.y());
    Eigen::Matrix2f a;
    a << q.topLeftCorner<2, 2>() - target * q.bottomLeftCorner<1, 2>();
    offset = a.inverse() * (target * q(2, 2) - q.topRightCorner<2, 1>());
  }
  return offset;
}

}  // namespace slsd
