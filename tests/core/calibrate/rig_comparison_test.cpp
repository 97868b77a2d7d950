// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/rig_comparison.hpp"

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kDegree = 0.0174533;

/// A new calibration of a rig, and what an earlier one said if it was right then.
class CompareRigs : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto outcome = calibrate(see(true_rig(), true_poses(10)), {.depth_min_mm = 1000, .depth_max_mm = 2500});
    if (!outcome) std::abort();
    outcome_ = new CalibrationOutcome(std::move(*outcome));
  }
  static void TearDownTestSuite() { delete outcome_; }

  static Calibration truth() { return true_rig().calibration(outcome_->observations.cameras); }
  static RigidTransform turned(double degrees, const Eigen::Vector3d& axis) {
    return {Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix(), Eigen::Vector3d::Zero()};
  }
  static RigComparison comparison_with(const Calibration& before) { return compare_rigs(*outcome_, before); }

  static CalibrationOutcome* outcome_;
};
CalibrationOutcome* CompareRigs::outcome_ = nullptr;

TEST_F(CompareRigs, FindsNoChangeInTheSameRig) {
  const RigComparison same = comparison_with(truth());
  EXPECT_THAT(same.change, IsEmpty());
  EXPECT_NEAR(same.longer_percent, 0, 0.3);
}

TEST_F(CompareRigs, TellsATurnOfTheProjectorAboutAnyAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double degrees : {0.3, 2.0}) {
      Calibration before = truth();
      RigidTransform& place = before.cameras[0].projector_from_camera;
      place = turned(degrees, Eigen::Vector3d::Unit(axis)).after(place);
      const RigComparison comparison = comparison_with(before);
      EXPECT_THAT(comparison.change, HasSubstr("the projector turned by")) << axis << " " << degrees;
      EXPECT_NEAR(std::stod(comparison.change.substr(comparison.change.find("by ") + 3)), degrees, 0.05);
      EXPECT_NEAR(comparison.longer_percent, 0, 0.3) << "a turn is no other scale";
    }
  }
}

TEST_F(CompareRigs, TellsATurnAndAShiftOfTheCamera) {
  Calibration before = truth();
  RigidTransform& place = before.cameras[0].projector_from_camera;
  place = place.after(turned(0.5, Eigen::Vector3d::UnitY()));
  const std::string change = comparison_with(before).change;
  EXPECT_THAT(change, HasSubstr("the camera turned by "));
  EXPECT_NEAR(std::stod(change.substr(change.find("by ") + 3)), 0.5, 0.05);
  before = truth();
  before.cameras[0].projector_from_camera.translation.y() += 5;
  EXPECT_THAT(comparison_with(before).change, HasSubstr("moved by 5."));
}

TEST_F(CompareRigs, TellsACameraThatIsUpsideDown) {
  Calibration before = truth();
  RigidTransform& place = before.cameras[0].projector_from_camera;
  place = place.after(turned(180, Eigen::Vector3d::UnitZ()));
  EXPECT_THAT(comparison_with(before).change, HasSubstr("about its axis, upside down"));
}

TEST_F(CompareRigs, TellsAnotherLens) {
  Calibration before = truth();
  before.cameras[0].lens.fx *= 1.02, before.cameras[0].lens.fy *= 1.02;
  EXPECT_THAT(comparison_with(before).change, HasSubstr("the camera has another lens, zoom or focus"));
}

// Of a print that is 3 % larger than it is said to be.
TEST_F(CompareRigs, TakesDistancesThatAllDifferAlikeForAnotherScale) {
  Calibration before = truth();
  before.cameras[0].projector_from_camera.translation *= 1.03;
  const RigComparison comparison = comparison_with(before);
  EXPECT_THAT(comparison.change, IsEmpty());
  EXPECT_NEAR(comparison.longer_percent, -2.9, 0.3);
}

}  // namespace
}  // namespace slsd
