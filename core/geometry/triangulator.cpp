// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulator.hpp"

#include <cmath>
#include <limits>

#include "core/clones.hpp"

namespace slsd {

namespace {

/// Data of many points, one column for each quantity.
struct Points {
  PixelRays::Column x, y, z, sigma_mm;
};

// With d the camera's direction (x, y, 1), a point is P = z d + (u, v, 0), and the camera's rows of (34) leave the
// residuals w = (fx u, fy v). The projector's rows A read A P = q z + L w = b. For a given z, |w|^2 + |q z + L w - b|^2
// is least at w = L' S (b - q z) with S = (I + L L')^-1, a 2x2 matrix. Then
//
//     z = q'S b / q'S q
//
// The slope along the ray with respect to the pixel follows from (37) by differentiation. It is the solution of the
// same normal equations with another right-hand side, here `pull`, found in the same way.
inline __attribute__((always_inline)) void solve_rays(const TriangulationRig& rig, const RayMatches& matches,
                                                      std::size_t count, Points& points) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto& [rotation, translation] = rig.projector_from_camera;
  const Eigen::Matrix3d r = rotation;
  const double t_x = translation.x(), t_y = translation.y(), t_z = translation.z();
  const double fx = rig.camera_focal_px.x(), fy = rig.camera_focal_px.y();
  const double per_fx = rig.per_camera_focal_px.x(), per_fy = rig.per_camera_focal_px.y();
  const double gx = rig.projector_focal_px.x(), gy = rig.projector_focal_px.y();
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double x = matches.camera.x[i], y = matches.camera.y[i];
    const double u = matches.projector_x[i], v = matches.projector_y[i];
    const double a00 = gx * (u * r(2, 0) - r(0, 0)), a01 = gx * (u * r(2, 1) - r(0, 1)),
                 a02 = gx * (u * r(2, 2) - r(0, 2)), a10 = gy * (v * r(2, 0) - r(1, 0)),
                 a11 = gy * (v * r(2, 1) - r(1, 1)), a12 = gy * (v * r(2, 2) - r(1, 2));
    const double b0 = gx * (t_x - u * t_z), b1 = gy * (t_y - v * t_z);
    const double q0 = a00 * x + a01 * y + a02, q1 = a10 * x + a11 * y + a12;
    const double l00 = a00 * per_fx, l01 = a01 * per_fy, l10 = a10 * per_fx, l11 = a11 * per_fy;
    const double i00 = 1 + l00 * l00 + l01 * l01, i11 = 1 + l10 * l10 + l11 * l11, i01 = l00 * l10 + l01 * l11;
    const double per_determinant = 1 / (i00 * i11 - i01 * i01);
    const double s00 = i11 * per_determinant, s01 = -i01 * per_determinant, s11 = i00 * per_determinant;
    const double sq0 = s00 * q0 + s01 * q1, sq1 = s01 * q0 + s11 * q1;
    const double per_qsq = 1 / (q0 * sq0 + q1 * sq1);

    const double z = (b0 * sq0 + b1 * sq1) * per_qsq;
    const double c0 = b0 - q0 * z, c1 = b1 - q1 * z;
    const double sc0 = s00 * c0 + s01 * c1, sc1 = s01 * c0 + s11 * c1;
    const double w0 = l00 * sc0 + l10 * sc1, w1 = l01 * sc0 + l11 * sc1;
    const double at_x = x * z + w0 * per_fx, at_y = y * z + w1 * per_fy;

    const double length_squared = 1 + x * x + y * y;
    const double e0 = x * per_fx, e1 = y * per_fy;
    const double le0 = l00 * e0 + l01 * e1, le1 = l10 * e0 + l11 * e1;
    const double pull_z = (length_squared - (sq0 * le0 + sq1 * le1)) * per_qsq;
    const double p0 = s00 * le0 + s01 * le1 + sq0 * pull_z, p1 = s01 * le0 + s11 * le1 + sq1 * pull_z;
    const double slope_u = -fx * (z * (e0 - (l00 * p0 + l10 * p1)) + pull_z * w0),
                 slope_v = -fy * (z * (e1 - (l01 * p0 + l11 * p1)) + pull_z * w1);
    const double by_u = slope_u * matches.camera.xx[i] + slope_v * matches.camera.yx[i],
                 by_v = slope_u * matches.camera.xy[i] + slope_v * matches.camera.yy[i];
    const bool in_front = r(2, 0) * at_x + r(2, 1) * at_y + r(2, 2) * z + t_z > 0;
    points.x[i] = in_front ? at_x : kNone, points.y[i] = in_front ? at_y : kNone, points.z[i] = in_front ? z : kNone;
    points.sigma_mm[i] = matches.sigma_px[i] * std::sqrt((by_u * by_u + by_v * by_v) / length_squared);
  }
}

}  // namespace

Triangulator::Triangulator(const CalibratedCamera& camera, const Lens& projector)
    : rig_{.projector_from_camera = camera.projector_from_camera,
           .camera_focal_px = {camera.lens.fx, camera.lens.fy},
           .per_camera_focal_px = {1 / camera.lens.fx, 1 / camera.lens.fy},
           .projector_focal_px = {projector.fx, projector.fy}} {}

void Triangulator::triangulate(const RayMatches& matches, std::span<TriangulatedPoint> points) const {
  Points solved;
  Cloned<solve_rays>::call(rig_, matches, points.size(), solved);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {{solved.x[i], solved.y[i], solved.z[i]}, solved.sigma_mm[i]};
}

}  // namespace slsd
