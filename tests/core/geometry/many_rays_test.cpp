// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "core/geometry/epipolar/epipolar_gate.hpp"
#include "core/geometry/ray_table.hpp"
#include "core/geometry/triangulator.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

/// Runs each clone that this machine has.
template <class Check>
void for_each_clone(Check&& check) {
  struct Restore {
    Clone usual = clone_in_use;
    ~Restore() { clone_in_use = usual; }
  } const restore;
  for (const Clone clone : clones_here()) {
    clone_in_use = clone;
    check();
  }
}

std::size_t any_count() {
  return *rc::gen::inRange<std::size_t>(1, PixelRays::kAtOnce + 1);
}

RC_GTEST_PROP(ManyRays, AreThoseOfEachPixel, ()) {
  const Lens lens = paper_rig().cameras[0].lens;
  const RayTable table(lens);
  const std::size_t count = any_count();
  PixelRays rays;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel = any_pixel(lens);
    rays.u[i] = pixel.x(), rays.v[i] = pixel.y();
  }
  for_each_clone([&] {
    table.look_up(rays, count);
    for (std::size_t i = 0; i < count; ++i) {
      const PixelRay ray = rays.at(i), plain = pixel_ray(lens, {rays.u[i], rays.v[i]});
      RC_ASSERT((ray.direction - plain.direction).norm() < 1e-9);
      RC_ASSERT((ray.turn - plain.turn).norm() < 1e-4 * plain.turn.norm());
    }
  });
}

RC_GTEST_PROP(ManyRays, HaveTheSegmentsAndResidualsOfEach, ()) {
  const Calibration rig = paper_rig();
  const EpipolarGate gate(rig.cameras[0], rig.projector, 400, 2500);
  const std::size_t count = any_count();
  PixelRays rays;
  RayPairs pairs;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d seen = rig.cameras[0].lens.undistort(any_pixel(rig.cameras[0].lens)),
                          lit = rig.projector.undistort(any_pixel(rig.projector));
    rays.x[i] = pairs.camera_x[i] = seen.x(), rays.y[i] = pairs.camera_y[i] = seen.y();
    pairs.projector_x[i] = lit.x(), pairs.projector_y[i] = lit.y();
  }
  const Eigen::Matrix3d& rotation = rig.cameras[0].projector_from_camera.rotation;
  const Eigen::Vector3d& translation = rig.cameras[0].projector_from_camera.translation;
  for_each_clone([&] {
    std::array<EpipolarSegment, PixelRays::kAtOnce> segments;
    std::array<float, PixelRays::kAtOnce> residuals_px{}, disparities{};
    gate.prepare(rays, std::span(segments).first(count));
    gate.compare(pairs, std::span(residuals_px).first(count), std::span(disparities).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d lit(pairs.projector_x[i], pairs.projector_y[i]);
      const Eigen::Vector3d slope = rotation * Eigen::Vector3d(rays.x[i], rays.y[i], 1),
                            line = translation.cross(slope);
      const double length = std::hypot(line.x() / rig.projector.fx, line.y() / rig.projector.fy);
      const double plain_px = (line.dot(lit.homogeneous())) / length;
      RC_ASSERT(std::abs(segments[i].residual_px(lit) - plain_px) < 1e-9 * std::abs(plain_px) + 1e-9);
      RC_ASSERT(std::abs(residuals_px[i] - plain_px) < 1e-6 * std::abs(plain_px) + 1e-6);
      // What both ends of the segment are seen at.
      for (const double depth_mm : {400 + 1e-6, 2500 - 1e-6}) {
        const Eigen::Vector3d end = depth_mm * slope + translation;
        RC_ASSERT(segments[i].passes(end.hnormalized(), 1e-6));
      }
      for (const double depth_mm : {399., 2501.})
        RC_ASSERT(!segments[i].passes((depth_mm * slope + translation).hnormalized(), 1e-6));
    }
  });
}

RC_GTEST_PROP(ManyRays, MeetWhereEachDoes, ()) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const Triangulator triangulator(camera, rig.projector);
  const std::size_t count = any_count();
  RayMatches matches;
  std::array<TriangulatedPoint, PixelRays::kAtOnce> plain;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d point = any_point(camera.lens, 400, 2500);
    const Match match{camera.lens.project(point) + Eigen::Vector2d(uniform(-2, 2), uniform(-2, 2)),
                      rig.projector.project(camera.projector_from_camera * point)};
    matches.set(i, pixel_ray(camera.lens, match.camera_px), rig.projector.undistort(match.projector_px), 0.07);
    plain[i] = triangulate(match, camera, rig.projector, 0.07);
  }
  for_each_clone([&] {
    std::array<TriangulatedPoint, PixelRays::kAtOnce> points;
    triangulator.triangulate(matches, std::span(points).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      RC_ASSERT((plain[i].point_in_camera - points[i].point_in_camera).norm() < 1e-4);
      RC_ASSERT(std::abs(plain[i].sigma_mm - points[i].sigma_mm) < 1e-4 * plain[i].sigma_mm);
    }
  });
}

}  // namespace
}  // namespace slsd
