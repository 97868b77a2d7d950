// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <ceres/jet.h>
#include <ceres/rotation.h>
#include <Eigen/Core>
#include <Eigen/LU>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd::test {

/// The residuals of core/calibrate/solve/residuals.hpp for any scalar, so that Ceres can differentiate them by itself:
/// slower by far, and without a derivative that was written down. Lens::distort(), to begin with.
template <class T>
Eigen::Matrix<T, 2, 1> distort(const T* lens, const T& x, const T& y) {
  const T &k1 = lens[4], &k2 = lens[5], &p1 = lens[6], &p2 = lens[7], &k3 = lens[8];
  const T r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {lens[0] * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + lens[2],
          lens[1] * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + lens[3]};
}

template <class T>
Eigen::Matrix<T, 3, 1> moved(const T* motion, const Eigen::Matrix<T, 3, 1>& point) {
  Eigen::Matrix<T, 3, 1> out;
  ceres::AngleAxisRotatePoint(motion, point.data(), out.data());
  return out + Eigen::Map<const Eigen::Matrix<T, 3, 1>>(motion + 3);
}

template <class T>
Eigen::Matrix<T, 3, 1> moved_back(const T* motion, const Eigen::Matrix<T, 3, 1>& point) {
  const T back[3] = {-motion[0], -motion[1], -motion[2]};
  const Eigen::Matrix<T, 3, 1> shifted = point - Eigen::Map<const Eigen::Matrix<T, 3, 1>>(motion + 3);
  Eigen::Matrix<T, 3, 1> out;
  ceres::AngleAxisRotatePoint(back, shifted.data(), out.data());
  return out;
}

/// Where the camera sees a point of the rig's frame, less where it was seen, in standard deviations.
template <class T>
void camera_residual(const T* lens, const T* camera_from_rig, const Eigen::Matrix<T, 3, 1>& point,
                     const Eigen::Vector2d& seen_px, double sigma_px, T* residual) {
  const Eigen::Matrix<T, 3, 1> in_camera = moved(camera_from_rig, point);
  const Eigen::Matrix<T, 2, 1> pixel =
      distort(lens, T(in_camera.x() / in_camera.z()), T(in_camera.y() / in_camera.z()));
  residual[0] = (pixel.x() - seen_px.x()) / sigma_px;
  residual[1] = (pixel.y() - seen_px.y()) / sigma_px;
}

inline double value_of(double x) {
  return x;
}
template <class Jet>
double value_of(const Jet& x) {
  return x.a;
}

/// A shape goes on level beyond two halves of the board.
template <class T>
T within_reach(const T& at) {
  return value_of(at) > 2 ? T(2) : value_of(at) < -2 ? T(-2) : at;
}

template <class T>
T height(const T* shape, const ShapeFrame& frame, const T& x, const T& y) {
  const T u = within_reach(T((x - frame.middle_mm.x()) / frame.half_mm)),
          v = within_reach(T((y - frame.middle_mm.y()) / frame.half_mm));
  return shape[0] * u * u + shape[1] * u * v + shape[2] * v * v + shape[3] * u * u * u + shape[4] * u * u * v +
         shape[5] * u * v * v + shape[6] * v * v * v + shape[7] * u * u * u * u + shape[8] * u * u * u * v +
         shape[9] * u * u * v * v + shape[10] * u * v * v * v + shape[11] * v * v * v * v;
}

/// A point of the board in the camera. The print is larger than it should be by `scale`, and by `stretch` along y; the
/// board is bent.
struct CornerResidual {
  Eigen::Vector2d camera_px, board_mm;
  double sigma_px;
  ShapeFrame frame;

  template <class T>
  bool operator()(const T* lens, const T* camera_from_rig, const T* rig_from_board, const T* scale, const T* stretch,
                  const T* shape, T* residual) const {
    const T x = board_mm.x() * (1.0 + scale[0]), y = board_mm.y() * (1.0 + scale[0]) * (1.0 + stretch[0]);
    const Eigen::Matrix<T, 3, 1> on_board(x, y, height(shape, frame, x, y));
    camera_residual(lens, camera_from_rig, moved(rig_from_board, on_board), camera_px, sigma_px, residual);
    return true;
  }
};

/// The direction of an exact pixel under a lens that changes. Found in plain numbers first; one step of Newton's method
/// from there carries the derivatives.
template <class T>
Eigen::Matrix<T, 2, 1> undistort(const T* lens, const Eigen::Vector2d& pixel) {
  LensVector values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = value_of(lens[i]);
  const Lens plain = to_lens(values, {});
  const Eigen::Vector2d direction = plain.undistort(pixel);
  const Eigen::Matrix2d step = plain.distort_jacobian(direction).inverse();
  const Eigen::Matrix<T, 2, 1> error = distort(lens, T(direction.x()), T(direction.y())) - pixel.cast<T>();
  return direction.cast<T>() - step.cast<T>() * error;
}

/// A projector pixel in the camera: its ray meets the bent board, and the camera sees that point. The pixel is exact;
/// what measures is the camera, which sees all symbols of a view shifted.
struct SymbolResidual {
  Eigen::Vector2d camera_px, projector_px;
  double sigma_px;
  ShapeFrame frame;

  template <class T>
  bool operator()(const T* camera, const T* camera_from_rig, const T* projector, const T* projector_from_rig,
                  const T* rig_from_board, const T* shift_px, const T* shape, T* residual) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Eigen::Matrix<T, 2, 1> pixel = undistort(projector, projector_px);
    const Vector eye = moved_back(projector_from_rig, Vector(T(0), T(0), T(0)));
    const Vector ray = moved_back(projector_from_rig, Vector(pixel.x(), pixel.y(), T(1))) - eye;
    const Vector from = moved_back(rig_from_board, eye), towards = moved_back(rig_from_board, Vector(eye + ray)) - from;
    // Each round of the secant method brings the value nearer and carries the derivatives.
    T before = -from.z() / towards.z(), along = before * 1.0001;
    const auto off = [&](const T& at) {
      const Vector point = from + at * towards;
      return height(shape, frame, point.x(), point.y()) - point.z();
    };
    for (int round = 0; round < 12 && value_of(off(along)) != value_of(off(before)); ++round) {
      const T next = along - off(along) * (along - before) / (off(along) - off(before));
      before = along, along = next;
    }
    camera_residual(camera, camera_from_rig, Vector(eye + along * ray), camera_px, sigma_px, residual);
    for (int i = 0; i < 2; ++i) residual[i] += shift_px[i] / sigma_px;
    return true;
  }
};

}  // namespace slsd::test
