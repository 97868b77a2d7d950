// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/calibrate.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

double turn_between_deg(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a * b.transpose()).angle() * 57.29578;
}

void expect_near_truth(const CalibrationOutcome& outcome, const RigModel& truth) {
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

const PoseReport& report_of(const CalibrationOutcome& outcome, const std::string& pose) {
  return *std::ranges::find(outcome.poses, pose, &PoseReport::name);
}

std::size_t left_out(const CalibrationOutcome& outcome) {
  return static_cast<std::size_t>(
      std::ranges::count_if(outcome.poses, [](const PoseReport& pose) { return pose.fault.has_value(); }));
}

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

TEST(Calibrate, NamesAPoseWithABentBoard) {
  const RigModel truth = true_rig();
  SightOptions options;
  options.relief = [](int pose, const Eigen::Vector2d& mm) {
    return pose == 4 ? 4 * std::pow((mm.x() - 225) / 225, 2) : 0;
  };
  const auto outcome = calibrate(see(truth, true_poses(12), options), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_EQ(report_of(*outcome, "pose_4").fault, PoseFault::kBent) << report_of(*outcome, "pose_4").reason;
  expect_near_truth(*outcome, truth);
}

// Of no second order: a plane through it is tilted, which is no move.
TEST(Calibrate, NamesAPoseWithABoardThatIsBentLikeAnS) {
  const RigModel truth = true_rig();
  for (const double bend_mm : {3, 10}) {
    SightOptions options;
    options.relief = [bend_mm](int pose, const Eigen::Vector2d& mm) {
      return pose == 5 ? bend_mm * std::sin(2 * std::numbers::pi * mm.x() / 450) : 0;
    };
    const auto outcome = calibrate(see(truth, true_poses(12), options), {});
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_EQ(left_out(*outcome), 1U);
    EXPECT_EQ(report_of(*outcome, "pose_5").fault, PoseFault::kBent) << report_of(*outcome, "pose_5").reason;
    expect_near_truth(*outcome, truth);
  }
}

TEST(Calibrate, ExplainsNoSkewedPictureByAMove) {
  const RigModel truth = true_rig();
  for (const double skew : {0.1, 0.3, 1.0}) {
    Observations observations = see(truth, true_poses(12));
    PoseView& view = observations.poses[5].views[0];
    for (BoardPoint& corner : view.corners) corner.camera_px.x() += skew * corner.camera_px.y();
    for (ProjectedPoint& symbol : view.symbols) symbol.camera_px.x() += skew * symbol.camera_px.y();
    const auto outcome = calibrate(observations, {});
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_EQ(left_out(*outcome), 1U);
    EXPECT_NE(report_of(*outcome, "pose_5").fault, PoseFault::kMoved) << report_of(*outcome, "pose_5").reason;
    expect_near_truth(*outcome, truth);
  }
}

TEST(Calibrate, NamesAPoseWhoseBoardMoved) {
  const RigModel truth = true_rig();
  SightOptions options;
  options.moved = [](int pose, const MotionVector& before) {
    MotionVector after = before;
    if (pose == 7) after[5] += 6, after[1] += 0.005;
    return after;
  };
  const auto outcome = calibrate(see(truth, true_poses(12), options), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_EQ(report_of(*outcome, "pose_7").fault, PoseFault::kMoved) << report_of(*outcome, "pose_7").reason;
  EXPECT_THAT(report_of(*outcome, "pose_7").reason, HasSubstr("moved"));
  expect_near_truth(*outcome, truth);
}

TEST(Calibrate, NamesAPoseWhoseBoardTurnedALittle) {
  const RigModel truth = true_rig();
  SightOptions options;
  options.moved = [](int pose, const MotionVector& before) {
    if (pose != 5) return before;
    const RigidTransform turn{
        Eigen::AngleAxisd(0.3 / 57.29578, Eigen::Vector3d(0.3, 1, 0).normalized()).toRotationMatrix(),
        Eigen::Vector3d::Zero()};
    const RigidTransform to_middle{Eigen::Matrix3d::Identity(), {225, 150, 0}};
    return to_vector(to_motion(before).after(to_middle).after(turn).after(to_middle.inverse()));
  };
  const auto outcome = calibrate(see(truth, true_poses(8), options), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_EQ(report_of(*outcome, "pose_5").fault, PoseFault::kMoved) << report_of(*outcome, "pose_5").reason;
  expect_near_truth(*outcome, truth);
}

TEST(Calibrate, SaysHowFarABoardMovedInSpiteOfMisreadSymbols) {
  const RigModel truth = true_rig();
  SightOptions options;
  options.moved = [](int pose, const MotionVector& before) {
    MotionVector after = before;
    if (pose == 3) after[5] += 10;
    return after;
  };
  Observations observations = see(truth, true_poses(8), options);
  std::mt19937 random(5);
  for (ProjectedPoint& symbol : observations.poses[3].views[0].symbols) {
    if (random() % 12 == 0) symbol.projector_px.x() += 18.0 * static_cast<double>(1 + random() % 20);
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  const PoseReport& moved = report_of(*outcome, "pose_3");
  EXPECT_EQ(moved.fault, PoseFault::kMoved);
  const double along_normal_mm = 10 * to_motion(true_poses(8)[3]).rotation(2, 2);
  const auto at = moved.reason.find("by ");
  ASSERT_NE(at, std::string::npos) << moved.reason;
  EXPECT_NEAR(std::stod(moved.reason.substr(at + 3)), along_normal_mm, 0.5) << moved.reason;
}

/// The symbols of a view as they are seen where the board was taken away before the pattern came: on a round thing
/// behind it, an upright cylinder.
void take_board_away(PoseView& view, const RigModel& rig, double distance_mm, double radius_mm) {
  const Lens camera = to_lens(rig.cameras[0].lens, rig.cameras[0].size),
             projector = to_lens(rig.projector.lens, rig.projector.size);
  const RigidTransform projector_from_rig = to_motion(rig.projector.device_from_rig);
  const double axis_mm = distance_mm + radius_mm;
  for (ProjectedPoint& symbol : view.symbols) {
    const Eigen::Vector3d ray = camera.undistort(symbol.camera_px).homogeneous();
    const double square = ray.x() * ray.x() + 1;
    const double root = axis_mm * axis_mm - square * (axis_mm * axis_mm - radius_mm * radius_mm);
    const double depth_mm = root > 0 ? (axis_mm - std::sqrt(root)) / square : distance_mm + 300;
    symbol.projector_px = projector.project(projector_from_rig * (depth_mm * ray));
  }
}

template <class Point>
void keep_each(std::vector<Point>& points, std::size_t step) {
  std::size_t i = 0;
  std::erase_if(points, [&](const Point&) { return i++ % step != 0; });
}

// No point of such a pose may be left that fits the others, or so few that they do not say where it is.
TEST(Calibrate, NamesAPoseOfWhichNothingFits) {
  struct Case {
    double distance_mm, radius_mm;
    std::size_t corner_step, symbol_step;
  };
  const RigModel truth = true_rig();
  for (const Case& gone : {Case{1700, 100, 1, 1}, {1900, 100, 5, 9}, {2300, 100, 5, 1}, {2300, 300, 1, 4}}) {
    Observations observations = see(truth, true_poses(12));
    PoseView& view = observations.poses[5].views[0];
    take_board_away(view, truth, gone.distance_mm, gone.radius_mm);
    keep_each(view.corners, gone.corner_step);
    keep_each(view.symbols, gone.symbol_step);
    const auto outcome = calibrate(observations, {});
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_EQ(left_out(*outcome), 1U);
    EXPECT_TRUE(report_of(*outcome, "pose_5").fault);
    expect_near_truth(*outcome, truth);
  }
}

TEST(Calibrate, NamesBlurredPoses) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, true_poses(12));
  observations.poses[2].views[0].blur_px = 2.1;
  observations.poses[9].views[0].blur_px = 1.4;
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 2U);
  EXPECT_EQ(report_of(*outcome, "pose_2").fault, PoseFault::kBlurred);
  EXPECT_EQ(report_of(*outcome, "pose_9").fault, PoseFault::kBlurred);
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
  EXPECT_THAT(outcome->verdict.reasons, testing::ElementsAre(HasSubstr("nowhere in the working range")));
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
  EXPECT_THAT(outcome.error().message, HasSubstr("1 of the poses can be used, and 3 are the least"));
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
void leave_a_row(PoseView& view) {
  std::erase_if(view.corners, [](const BoardPoint& corner) {
    return corner.board_mm.y() > 1 && (corner.board_mm.y() > 51 || corner.board_mm.x() > 1);
  });
}

TEST(Calibrate, LeavesOutPosesWhoseCornersAreInARow) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, true_poses(12));
  leave_a_row(observations.poses[2].views[0]), leave_a_row(observations.poses[7].views[0]);
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 2U);
  EXPECT_EQ(report_of(*outcome, "pose_2").fault, PoseFault::kTooFewCorners);
  EXPECT_THAT(report_of(*outcome, "pose_7").reason, HasSubstr("11 corners found are along a line"));
  expect_near_truth(*outcome, truth);
}

TEST(Calibrate, LeavesOutViewsOfOneCameraThatShowTooLittle) {
  const RigModel truth = true_rig(2);
  Observations observations = see(truth, true_poses(12));
  leave_a_row(observations.poses[0].views[1]);
  observations.poses[4].views[1].corners.resize(3);
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 0U);
  EXPECT_THAT(report_of(*outcome, "pose_0").without, testing::ElementsAre(HasSubstr("camera camera1: the 11 corners")));
  EXPECT_THAT(report_of(*outcome, "pose_4").without, testing::ElementsAre(HasSubstr("camera camera1: only 3 of")));
  EXPECT_EQ(report_of(*outcome, "pose_4").corners, 70U);
  EXPECT_EQ(outcome->observations.poses[4].views.size(), 1U);
  expect_near_truth(*outcome, truth);
}

}  // namespace
}  // namespace slsd
