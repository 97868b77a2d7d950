// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/simulator/simulator.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <Eigen/LU>

namespace slsd {
namespace {

constexpr double kQuiet = 0;

Surface tilted_plane() {
  return plane({0, 0, 2000}, {0.3, 0.1, -1});
}

// The dot's centre of gravity above the dark level.
Eigen::Vector2d centre_of_light(const Grey8& frame, double dark) {
  Eigen::Vector2d sum(0, 0);
  double weight = 0;
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double light = frame.at(x, y) - dark;
      sum += light * Eigen::Vector2d(x, y);
      weight += light;
    }
  }
  return sum / weight;
}

TEST(PaperRig, HasItsBaselineAndAimsAtTheMiddle) {
  const Calibration rig = paper_rig();
  const RigidTransform& motion = rig.cameras[0].projector_from_camera;
  EXPECT_NEAR((motion.inverse().translation - Eigen::Vector3d(180, 0, 40)).norm(), 0, 1e-9);
  EXPECT_NEAR(motion.rotation.determinant(), 1, 1e-12);
  const Eigen::Vector2d middle = rig.projector.project(motion * Eigen::Vector3d(0, 0, 2000));
  EXPECT_NEAR((middle - Eigen::Vector2d(639.5, 399.5)).norm(), 0, 1e-9);
}

TEST(CameraFromProjector, IsUndoneByProjectorFromCamera) {
  const Calibration rig = paper_rig();
  for (const Surface& surface : {tilted_plane(), cylinder({0, 0, 2000}, {0, 1, 0}, 150)}) {
    const Eigen::Vector2d pixel(650.25, 310.5);
    const auto seen = camera_from_projector(pixel, rig, surface);
    ASSERT_TRUE(seen);
    const auto back = projector_from_camera(*seen, rig, surface);
    ASSERT_TRUE(back);
    EXPECT_NEAR((*back - pixel).norm(), 0, 1e-6);
  }
}

TEST(CameraFromProjector, FindsNothingBesideACylinder) {
  EXPECT_FALSE(camera_from_projector({5, 400}, paper_rig(), cylinder({0, 0, 2000}, {0, 1, 0}, 150)));
}

TEST(ProjectorFromCamera, FindsNothingInShadow) {
  // The camera sees the cylinder's left flank, which the projector on the right does not light.
  const Surface surface = cylinder({0, 0, 2000}, {0, 1, 0}, 150);
  const Calibration rig = paper_rig();
  const Eigen::Vector2d flank = rig.cameras[0].lens.project({-149.4, 0, 1990});
  EXPECT_FALSE(projector_from_camera(flank, rig, surface));
}

TEST(Simulate, PutsLightWhereTheGeometrySays) {
  Grey8 pattern(1280, 800);
  for (int y = 300; y < 308; ++y) {
    for (int x = 600; x < 608; ++x) pattern.at(x, y) = 255;
  }
  SimulationOptions options;
  options.noise_sigma = kQuiet;
  options.dark = 0;
  const Grey8 frame = simulate(pattern, paper_rig(), tilted_plane(), options);
  const auto seen = camera_from_projector({603.5, 303.5}, paper_rig(), tilted_plane());
  ASSERT_TRUE(seen);
  EXPECT_NEAR((centre_of_light(frame, 0) - *seen).norm(), 0, 0.02);
}

TEST(Simulate, FallsOffToTheRightByTheRatioAskedFor) {
  SimulationOptions options;
  options.noise_sigma = kQuiet;
  options.falloff = 10;
  const Grey8 frame = simulate(Grey8(1280, 800, 255), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), options);
  EXPECT_EQ(frame.at(0, 600), 170);
  EXPECT_EQ(frame.at(1599, 600), 17);
}

TEST(Simulate, AddsTheNoiseAskedFor) {
  SimulationOptions options;
  options.noise_sigma = 5;
  const Grey8 frame = simulate(Grey8(1280, 800), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), options);
  double square = 0;
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) square += (frame.at(x, y) - 20.) * (frame.at(x, y) - 20.);
  }
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(frame.size())), 5, 0.1);
}

}  // namespace
}  // namespace slsd
