// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/find_sphere.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include <Eigen/Geometry>

#include "seen_artefacts.hpp"

namespace slsd {
namespace {

constexpr double kWallMm = 700;

std::vector<Eigen::Vector3d> places_of(const std::vector<DensePoint>& points) {
  std::vector<Eigen::Vector3d> places;
  for (const DensePoint& point : points) places.push_back(point.place_mm.cast<double>());
  return places;
}

double wall(const Eigen::Vector3d& ray) {
  return ray_to_plane(ray, Eigen::Vector3d(0.3, 0, 1).normalized(), kWallMm);
}

TEST(FitSphere, FindsASphereOfFewPoints) {
  const Sphere truth{{10, -20, 500}, 25};
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& out : {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0.6, 0, -0.8),
                                     Eigen::Vector3d(0, 0.6, -0.8), Eigen::Vector3d(-0.28, -0.96, 0)})
    points.push_back(truth.centre_mm + truth.radius_mm * out);
  const auto sphere = fit_sphere(points, {{12, -18, 503}, 22});
  ASSERT_TRUE(sphere);
  EXPECT_LT((sphere->centre_mm - truth.centre_mm).norm(), 1e-6);
  EXPECT_NEAR(sphere->radius_mm, 25, 1e-6);
  EXPECT_FALSE(fit_sphere(std::span(points).first(3), truth));
}

TEST(FindSpheres, FindsTwoBeforeAWall) {
  const Sphere one{{-60, 10, 600}, 20}, other{{70, -30, 560}, 20};
  const auto points = places_of(see(
      [&](const Eigen::Vector3d& ray) {
        return std::min({wall(ray), ray_to_sphere(ray, one), ray_to_sphere(ray, other)});
      },
      0.05, 3));
  auto found = find_spheres(points, 40, 3);
  ASSERT_EQ(found.size(), 2U);
  std::ranges::sort(found, {}, [](const SeenSphere& seen) { return seen.sphere.centre_mm.x(); });
  EXPECT_LT((found[0].sphere.centre_mm - one.centre_mm).norm(), 0.02);
  EXPECT_LT((found[1].sphere.centre_mm - other.centre_mm).norm(), 0.02);
  EXPECT_NEAR(found[0].sphere.radius_mm, 20, 0.02);
}

TEST(FindSpheres, TakesNoOtherThing) {
  EXPECT_TRUE(find_spheres(places_of(see(wall, 0.05, 4)), 40, 1).empty());
  EXPECT_TRUE(find_spheres({}, 40, 1).empty());
  const auto cylinder = [](const Eigen::Vector3d& ray) {  // of radius 20 around a vertical axis
    const Sphere round{{0, 0, 600}, 20};
    const double across = Eigen::Vector2d(ray.x(), ray.z()).norm();
    const double distance = ray_to_sphere(Eigen::Vector3d(ray.x() / across, 0, ray.z() / across), round) / across;
    return std::min(distance, wall(ray));
  };
  EXPECT_TRUE(find_spheres(places_of(see(cylinder, 0.05, 5)), 40, 1).empty());
  const Sphere small{{0, 0, 600}, 14};
  EXPECT_TRUE(
      find_spheres(
          places_of(
              see([&](const Eigen::Vector3d& ray) { return std::min(wall(ray), ray_to_sphere(ray, small)); }, 0.05, 6)),
          40, 1)
          .empty());
}

}  // namespace
}  // namespace slsd
