// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/calibrate/calibrate.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd::test {

inline double turn_between_deg(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a * b.transpose()).angle() * 57.29578;
}

inline void expect_near_truth(const CalibrationOutcome& outcome, const RigModel& truth) {
  const auto near = [](const LensVector& found, const LensVector& is) {
    EXPECT_NEAR(found[0] / is[0], 1, 0.001);
    EXPECT_NEAR(found[1] / is[1], 1, 0.001);
    EXPECT_NEAR(found[2], is[2], 3);
    EXPECT_NEAR(found[3], is[3], 3);
  };
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) near(outcome.rig.cameras[i].lens, truth.cameras[i].lens);
  near(outcome.rig.projector.lens, truth.projector.lens);
  const RigidTransform found = to_motion(outcome.rig.projector.device_from_rig),
                       is = to_motion(truth.projector.device_from_rig);
  EXPECT_LT(turn_between_deg(found.rotation, is.rotation), 0.02);
  EXPECT_NEAR(found.translation.norm(), is.translation.norm(), 0.2);
}

inline const PoseReport& report_of(const CalibrationOutcome& outcome, const std::string& pose) {
  return *std::ranges::find(outcome.poses, pose, &PoseReport::name);
}

inline std::size_t left_out(const CalibrationOutcome& outcome) {
  return static_cast<std::size_t>(
      std::ranges::count_if(outcome.poses, [](const PoseReport& pose) { return pose.fault.has_value(); }));
}

}  // namespace slsd::test
