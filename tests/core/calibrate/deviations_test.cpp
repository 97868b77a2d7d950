// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Reported standard deviations against true errors, over many rigs: of lenses that have terms of distortion that the
// poses do not tell.
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/calibrate/calibrate.hpp"
#include "core/geometry/triangulate.hpp"
#include "tests/core/calibrate/some_rig.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

void thin(Observations& observations, std::size_t corner_step, std::size_t symbol_step) {
  const auto keep = [](auto& points, std::size_t step) {
    std::size_t i = 0;
    std::erase_if(points, [&](const auto&) { return i++ % step != 0; });
  };
  for (PoseObservation& pose : observations.poses) {
    keep(pose.views[0].corners, corner_step), keep(pose.views[0].symbols, symbol_step);
  }
}

/// Where the calibration puts a point of the truth in the middle of the picture, in depths too much, mm.
double depth_error_mm(double depth_mm, const RigModel& found, const RigModel& truth) {
  const auto device = [](const RigModel& rig) {
    return CalibratedCamera{
        "", to_lens(rig.cameras[0].lens, rig.cameras[0].size), to_motion(rig.projector.device_from_rig), {}};
  };
  const auto projector = [](const RigModel& rig) { return to_lens(rig.projector.lens, rig.projector.size); };
  const CalibratedCamera is = device(truth);
  const Eigen::Vector3d point = depth_mm * is.lens.undistort({800, 600}).homogeneous();
  const Match match{is.lens.project(point), projector(truth).project(is.projector_from_camera * point)};
  return triangulate(match, device(found), projector(found), 1).point_in_camera.z() - depth_mm;
}

/// Of many rigs and sessions, whose symbols are seen shifted, those of a view alike.
void expect_deviations_to_hold(double symbol_shift_px, double noise) {
  constexpr unsigned kTrials = 30;
  std::map<std::string, Ratios> of;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    std::mt19937 random(trial + 100);
    const RigModel truth = some_rig(random);
    SightOptions options;
    options.seed = static_cast<std::uint32_t>(random());
    options.corner_sigma_px = 0.01 + 0.01 * (trial % 5), options.symbol_sigma_px = noise * (0.05 + 0.03 * (trial % 3));
    options.symbol_shift_px = symbol_shift_px;
    Observations seen =
        see(truth, true_poses(8 + static_cast<int>(trial % 7), static_cast<std::uint32_t>(random())), options);
    thin(seen, 1 + (trial % 2), 2 + (trial % 4));
    const auto outcome = calibrate(seen, {.depth_min_mm = 1000, .depth_max_mm = 2500});
    ASSERT_TRUE(outcome) << outcome.error().message;
    for (const ParameterReport& parameter : outcome->parameters) {
      const double ratio = (parameter.value - truth_of(parameter, truth)) / parameter.sigma;
      of[(parameter.device == "projector" ? "projector " : "camera ") + parameter.name].add(ratio);
      EXPECT_LT(std::abs(ratio), 4) << "trial " << trial << ": " << parameter.device << " " << parameter.name;
    }
    for (const DepthUncertainty& depth : outcome->depth) {
      of["depth"].add(depth_error_mm(depth.depth_mm, outcome->rig, truth) / depth.calibration_mm);
    }
  }
  for (const auto& [name, ratios] : of) {
    std::printf("%-20s error over deviation: RMS %.2f, worst %.2f of %d\n", name.c_str(), ratios.rms(), ratios.worst,
                ratios.count);
    EXPECT_LT(ratios.rms(), 1.4) << name;
    EXPECT_LT(ratios.worst, 4) << name;
    // What is hardly seen stays where it was thought to be, at no error where lenses have none of it.
    if (name.find(" k") == name.npos && name.find(" p1") == name.npos && name.find(" p2") == name.npos) {
      EXPECT_GT(ratios.rms(), 0.7) << name;
    }
  }
}

TEST(Calibrate, ReportsDeviationsThatHold) {
  expect_deviations_to_hold(0, 1);
}

TEST(Calibrate, ReportsDeviationsThatHoldWhereAllSymbolsOfAViewAreShifted) {
  expect_deviations_to_hold(0.006, 0.2);
}

}  // namespace
}  // namespace slsd
