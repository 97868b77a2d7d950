// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/measure_artefact.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <numbers>

#include <Eigen/Geometry>

#include "seen_artefacts.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

constexpr double kSigmaMm = 0.05;

// Six sigmas hold 99.7 % of normal errors: what remains after the farthest three in a thousand are left out. Errors
// along the rays are less along the plate's normal.
TEST(MeasurePlate, GivesTheRangeOfItsErrors) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
  const auto points = see([&](const Eigen::Vector3d& ray) { return ray_to_plane(ray, normal, 600); }, kSigmaMm, 1);
  const auto plate = measure_plate(points);
  ASSERT_TRUE(plate);
  EXPECT_NEAR(plate->form.range_mm, 0.93 * 6 * kSigmaMm, 0.5 * kSigmaMm);
  EXPECT_NEAR(plate->form.range_95_mm, 0.93 * 2 * 1.96 * kSigmaMm, 0.1 * kSigmaMm);
  EXPECT_NEAR(plate->form.error_over_sigma, 1, 0.05);
  EXPECT_EQ(plate->form.points, points.size());
  EXPECT_EQ(plate->form.left_out, points.size() * 3 / 1000);
  EXPECT_NEAR(plate->tilt_deg, std::acos(normal.z()) * 180 / std::numbers::pi, 2);
  EXPECT_GT(plate->long_side_mm, 480);
}

TEST(MeasurePlate, SeesAWarp) {
  const auto bent = [](const Eigen::Vector3d& ray) {
    const double z = 600 / ray.z();
    return z + 0.4 * std::cos(ray.x() * z / 120);
  };
  const auto plate = measure_plate(see(bent, 0.005, 2));
  ASSERT_TRUE(plate);
  EXPECT_NEAR(plate->form.range_mm, 0.4 * (1 - std::cos(2)), 0.03);
  EXPECT_GT(plate->form.error_over_sigma, 20);
}

TEST(MeasureSphere, GivesFormAndSize) {
  const Sphere truth{{30, -20, 600}, 25.05};
  const auto points = see(
      [&](const Eigen::Vector3d& ray) {
        return std::min(ray_to_sphere(ray, truth), ray_to_plane(ray, Eigen::Vector3d::UnitZ(), 700));
      },
      kSigmaMm, 3);
  const auto sphere = measure_sphere(points, 50);
  ASSERT_TRUE(sphere);
  EXPECT_NEAR(sphere->size_error_mm, 0.1, 0.03);
  // Errors along the ray are less along the surface's normal.
  EXPECT_NEAR(sphere->form.range_mm, 5 * kSigmaMm, 1.2 * kSigmaMm);
  EXPECT_NEAR((sphere->sphere.centre_mm - truth.centre_mm).norm(), 0, 0.03);
}

TEST(MeasureBar, GivesTheSpacing) {
  const Sphere one{{-80, 0, 600}, 15}, other{{70, 20, 590}, 15};
  const double spacing = (one.centre_mm - other.centre_mm).norm();
  const auto points =
      see([&](const Eigen::Vector3d& ray) { return std::min(ray_to_sphere(ray, one), ray_to_sphere(ray, other)); },
          kSigmaMm, 4);
  const auto bar = measure_bar(points, 30, spacing - 0.2);
  ASSERT_TRUE(bar);
  EXPECT_NEAR(bar->spacing_error_mm, 0.2, 0.03);
  EXPECT_THAT(measure_bar(points, 30, 400).error().message, HasSubstr("but the bar's should be 400 mm apart"));
  const auto half = see([&](const Eigen::Vector3d& ray) { return ray_to_sphere(ray, one); }, kSigmaMm, 5);
  EXPECT_THAT(measure_bar(half, 30, spacing).error().message, HasSubstr("only one"));
}

TEST(MeasureArtefact, RefusesAnEmptyCloud) {
  EXPECT_EQ(measure_plate({}).error().code, ErrorCode::kNotFound);
  EXPECT_THAT(measure_sphere({}, 50).error().message, HasSubstr("no sphere of 50 mm"));
  EXPECT_EQ(measure_bar({}, 50, 200).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace slsd
