// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/calibrate.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/calibrate/outcome.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using test::expect_near_truth;
using test::left_out;
using test::turn_between_deg;
using testing::HasSubstr;

TEST(Calibrate, RecoversTheRig) {
  const RigModel truth = true_rig();
  const auto outcome = calibrate(see(truth, true_poses(12)), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  expect_near_truth(*outcome, truth);
  EXPECT_EQ(left_out(*outcome), 0U);
  EXPECT_EQ(outcome->verdict.grade, Grade::kGood) << testing::PrintToString(outcome->verdict.reasons);
  EXPECT_LT(outcome->camera_rms_px, 0.1);
  EXPECT_LT(outcome->projector_rms_px, 0.15);
  EXPECT_GT(outcome->held_out_symbol_px, outcome->symbol_rms_px);
  EXPECT_GT(outcome->held_out_corner_px, outcome->camera_rms_px);
}

TEST(Calibrate, WeighsEachPoseByItsOwnNoise) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, true_poses(12));
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.05);
  for (BoardPoint& corner : observations.poses[3].views[0].corners)
    corner.camera_px += Eigen::Vector2d(noise(random), noise(random));
  for (ProjectedPoint& symbol : observations.poses[7].views[0].symbols)
    symbol.camera_px += Eigen::Vector2d(noise(random), noise(random));
  const auto outcome = calibrate(std::move(observations), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 0U);
  for (std::size_t i = 0; i < 12; ++i) {
    const PoseView& view = outcome->observations.poses[i].views[0];
    SCOPED_TRACE(outcome->observations.poses[i].name);
    EXPECT_GT(view.corner_noise, i == 3 ? 1.25 : 0.8);
    EXPECT_LT(view.corner_noise, i == 3 ? 2.5 : 1.2);
    EXPECT_GT(view.symbol_noise, i == 7 ? 1.1 : 0.7);
    EXPECT_LT(view.symbol_noise, i == 7 ? 1.4 : 1.1);
  }
  expect_near_truth(*outcome, truth);
}

TEST(Calibrate, SaysHowSureItIsOfEachParameter) {
  const RigModel truth = true_rig();
  constexpr int kTrials = 5;
  std::map<std::string, double> chi;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const auto outcome = calibrate(see(truth, true_poses(10, trial + 3), {.seed = trial}), {});
    ASSERT_TRUE(outcome) << outcome.error().message;
    for (const ParameterReport& parameter : outcome->parameters) {
      if (parameter.device != "projector" || parameter.name.size() != 2 || parameter.name[0] == 'p') continue;
      const std::size_t index = parameter.name == "fx"   ? 0
                                : parameter.name == "fy" ? 1
                                : parameter.name == "cx" ? 2
                                                         : 3;
      if (parameter.name[0] == 'k') continue;
      const double off = (parameter.value - truth.projector.lens[index]) / parameter.sigma;
      chi[parameter.name] += off * off / kTrials;
    }
  }
  EXPECT_EQ(chi.size(), 4U);
  for (const auto& [name, mean_square] : chi) {
    EXPECT_GT(mean_square, 0.05) << name << ": the deviation is far too large";
    EXPECT_LT(mean_square, 4) << name << ": the deviation is far too small";
  }
}

TEST(Calibrate, TakesSeveralCamerasIntoOneRig) {
  const RigModel truth = true_rig(2);
  const auto outcome = calibrate(see(truth, true_poses(10)), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  expect_near_truth(*outcome, truth);
  const RigidTransform found = to_motion(outcome->rig.cameras[1].device_from_rig),
                       is = to_motion(truth.cameras[1].device_from_rig);
  EXPECT_LT(turn_between_deg(found.rotation, is.rotation), 0.02);
  EXPECT_LT((found.translation - is.translation).norm(), 0.5);
  EXPECT_EQ(outcome->calibration.cameras.size(), 2U);
  const Eigen::Vector3d point(30, -20, 2000);
  const CalibratedCamera& second = outcome->calibration.cameras[1];
  EXPECT_LT((second.rig_from_camera * (found * point) - point).norm(), 1e-6);
}

TEST(Calibrate, LeavesWrongSymbolsOut) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, true_poses(10));
  std::mt19937 random(5);
  std::size_t wrong = 0;
  for (PoseObservation& pose : observations.poses) {
    for (ProjectedPoint& symbol : pose.views[0].symbols) {
      if (random() % 50 != 0) continue;
      symbol.projector_px.x() += 18.0 * static_cast<double>(1 + random() % 20);
      ++wrong;
    }
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  expect_near_truth(*outcome, truth);
  std::size_t outlying = 0;
  for (const PoseReport& pose : outcome->poses) outlying += pose.outlying_symbols;
  EXPECT_GE(outlying, wrong);
  EXPECT_LT(outlying, wrong + 30);
}

TEST(Calibrate, FindsThatAPrintIsStretched) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, true_poses(12), {.corner_sigma_px = 0.018, .stretch = 0.03});
  for (PoseObservation& pose : observations.poses) {  // few corners: without the stretch their errors pass for noise
    std::erase_if(pose.views[0].corners, [](const BoardPoint& corner) {
      return std::lround(corner.board_mm.x() / 50) % 2 != 0 || std::lround(corner.board_mm.y() / 50) % 2 != 0;
    });
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  ASSERT_EQ(outcome->warnings.size(), 1U);
  EXPECT_THAT(outcome->warnings[0], HasSubstr("stretched: it is 3.0"));
  EXPECT_THAT(outcome->warnings[0], HasSubstr("longer along its columns"));
  EXPECT_NEAR(outcome->rig.board_stretch, 0.03, 0.0003);
  EXPECT_LT(outcome->camera_rms_px, 0.03);
  EXPECT_NE(outcome->verdict.grade, Grade::kGood);
  expect_near_truth(*outcome, truth);
}

TEST(Calibrate, RefusesAMirroredProjector) {
  Observations observations = see(true_rig(), true_poses(12));
  for (PoseObservation& pose : observations.poses) {
    for (ProjectedPoint& symbol : pose.views[0].symbols) symbol.projector_px.x() = 1279 - symbol.projector_px.x();
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::kImpossible);
  EXPECT_THAT(outcome.error().message, HasSubstr("mirrored"));
}

TEST(Calibrate, IsBadWhereNothingOfTheWorkingRangeIsSeen) {
  const auto outcome = calibrate(see(true_rig(), true_poses(12)), {.depth_min_mm = 100, .depth_max_mm = 300});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_TRUE(outcome->depth.empty());
  EXPECT_EQ(outcome->verdict.grade, Grade::kBad);
  EXPECT_THAT(outcome->verdict.reasons, testing::ElementsAre(HasSubstr("share no view in the working range")));
}

TEST(Calibrate, RefusesParallelPoses) {
  for (const double tilt_deg : {0, 5, 17, 30, 45}) {
    for (const double turn_rad : {0.0, 0.1}) {
      for (const double step_mm : {5, 60}) {
        const Eigen::Matrix3d tilted =
            Eigen::AngleAxisd(tilt_deg / 57.29578, Eigen::Vector3d(0.8, 0.6, 0)).toRotationMatrix();
        std::vector<MotionVector> poses;
        for (int i = 0; i < 8; ++i) {
          const Eigen::Matrix3d turn =
              tilted * Eigen::AngleAxisd(turn_rad * i, Eigen::Vector3d::UnitZ()).toRotationMatrix();
          const Eigen::Vector3d middle(40 * (i % 3) - 40, 30 * (i % 4) - 45, 1700 + step_mm * i);
          poses.push_back(to_vector(RigidTransform{turn, middle - turn * Eigen::Vector3d(225, 150, 0)}));
        }
        const auto outcome = calibrate(see(true_rig(), poses), {});
        ASSERT_FALSE(outcome) << tilt_deg << " degrees, " << turn_rad << " rad, " << step_mm << " mm";
        EXPECT_THAT(outcome.error().message, HasSubstr("parallel")) << tilt_deg << ", " << turn_rad << ", " << step_mm;
      }
    }
  }
}

TEST(Calibrate, TakesFewPosesThatAreTiltedALittle) {
  const double tilt = 6 / 57.29578;
  for (const std::size_t count : {3, 4}) {
    std::vector<MotionVector> poses;
    for (std::size_t i = 0; i < count; ++i) {
      const double towards = 2 * std::numbers::pi / static_cast<double>(count) * static_cast<double>(i);
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(towards), std::sin(towards), 0)).toRotationMatrix();
      const Eigen::Vector3d middle(50 * std::cos(towards), 40 * std::sin(towards), 1800 + 80 * static_cast<double>(i));
      poses.push_back(to_vector(RigidTransform{turn, middle - turn * Eigen::Vector3d(225, 150, 0)}));
    }
    const auto outcome = calibrate(see(true_rig(), poses), {});
    EXPECT_TRUE(outcome) << outcome.error().message;
  }
}

TEST(Calibrate, RefusesOnePose) {
  const auto outcome = calibrate(see(true_rig(), true_poses(1)), {});
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::kImpossible);
  EXPECT_THAT(outcome.error().message, HasSubstr("1 of the poses can be used, but at least 3 are needed"));
}

TEST(Calibrate, SaysWhyTooFewPosesAreLeft) {
  Observations observations = see(true_rig(), true_poses(4));
  observations.poses[1].views[0].symbols.resize(5);
  observations.poses[3].views[0].corners.resize(5);
  const auto outcome = calibrate(observations, {});
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message, HasSubstr("pose_1: only 5 of the pattern's symbols"));
  EXPECT_THAT(outcome.error().message, HasSubstr("pose_3: only 5 of the board's corners"));
}

/// Corners in one row of the board, and one more: the box about them has an area.
}  // namespace
}  // namespace slsd
