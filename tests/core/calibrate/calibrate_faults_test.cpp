// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Poses that have to be found, named and left out.
#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/calibrate/calibrate.hpp"
#include "tests/core/calibrate/outcome.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using test::expect_near_truth;
using test::left_out;
using test::report_of;
using testing::HasSubstr;

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

/// Poses as people hold them: not tilted much, nor at many distances.
std::vector<MotionVector> alike_poses(int count, std::uint32_t seed) {
  std::vector<MotionVector> poses = true_poses(count, seed);
  for (MotionVector& pose : poses) pose[0] *= 0.5, pose[1] *= 0.5, pose[5] = 2000 + 0.3 * (pose[5] - 2000);
  return poses;
}

void turn_upside_down(PoseView& view, const ImageSize& size) {
  const auto turn = [&](Eigen::Vector2d& px) { px = {size.width_px - 1 - px.x(), size.height_px - 1 - px.y()}; };
  for (BoardPoint& corner : view.corners) turn(corner.camera_px);
  for (ProjectedPoint& symbol : view.symbols) turn(symbol.camera_px);
}

// Their corners are those of a board, but their symbols are nowhere near where the other poses have them.
TEST(Calibrate, GivesPicturesThatAreUpsideDownNoPart) {
  const RigModel truth = true_rig();
  for (const std::size_t count : {5U, 8U, 10U}) {
    for (const std::size_t wrong : {1U, 2U}) {
      for (const std::size_t first : {0U, 3U}) {
        if (count == 5 && wrong > 1) continue;
        Observations observations = see(truth, alike_poses(static_cast<int>(count), 3));
        for (std::size_t i = first; i < first + wrong; ++i) {
          turn_upside_down(observations.poses[i].views[0], observations.cameras[0].size);
        }
        const auto outcome = calibrate(observations, {});
        ASSERT_TRUE(outcome) << count << " poses: " << outcome.error().message;
        EXPECT_EQ(left_out(*outcome), wrong) << count << " poses";
        for (std::size_t i = first; i < first + wrong; ++i) {
          EXPECT_TRUE(report_of(*outcome, "pose_" + std::to_string(i)).fault) << count << " poses";
        }
        EXPECT_NEAR(outcome->rig.cameras[0].lens[0], truth.cameras[0].lens[0], 0.002 * truth.cameras[0].lens[0]);
      }
    }
  }
}

// Two that are not side by side, among poses that leave no half without one.
TEST(Calibrate, GivesPicturesThatAreUpsideDownAnywhereNoPart) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, alike_poses(10, 3));
  for (const std::size_t i : {2U, 7U}) {
    turn_upside_down(observations.poses[i].views[0], observations.cameras[0].size);
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 2U);
  EXPECT_TRUE(report_of(*outcome, "pose_2").fault);
  EXPECT_THAT(report_of(*outcome, "pose_7").reason, HasSubstr("almost no point of it agrees with them"));
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

// Three poses that were copied are three poses still.
TEST(Calibrate, CountsRepeatedPosesOnce) {
  Observations observations = see(true_rig(), true_poses(4));
  for (int copy = 0; copy < 3; ++copy) {
    for (std::size_t i = 0; i < 4; ++i) {
      PoseObservation again = observations.poses[i];
      again.name = "pose_" + std::to_string(observations.poses.size());
      for (BoardPoint& corner : again.views[0].corners) corner.camera_px.x() += copy;  // held in the hand
      observations.poses.push_back(std::move(again));
    }
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 12U);
  EXPECT_EQ(report_of(*outcome, "pose_9").fault, PoseFault::kRepeated);
  EXPECT_THAT(report_of(*outcome, "pose_9").reason, HasSubstr("in the same place as pose_1"));
  EXPECT_NE(outcome->verdict.grade, Grade::kGood);
}

// A board in centimetres fits as well, with a rig of a tenth of the size.
TEST(Calibrate, GivesBoardsFarFromTheWorkingRangeABadVerdict) {
  Observations observations = see(true_rig(), true_poses(12));
  for (PoseObservation& pose : observations.poses)
    for (BoardPoint& corner : pose.views[0].corners) corner.board_mm /= 10;
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(outcome->verdict.grade, Grade::kBad);
  EXPECT_THAT(outcome->verdict.reasons, testing::Contains(HasSubstr("mm away, but the working range is")));
  EXPECT_THAT(outcome->verdict.advice, testing::Contains(HasSubstr("lengths of --board in millimetres")));
}

TEST(Calibrate, NamesClippedPoses) {
  Observations observations = see(true_rig(), true_poses(12));
  observations.poses[2].views[0].clipped_share = 0.82;
  observations.poses[5].views[0].clipped_share = 0.1;
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_EQ(report_of(*outcome, "pose_2").fault, PoseFault::kClipped);
  EXPECT_THAT(report_of(*outcome, "pose_2").reason, HasSubstr("clipped: 82 %"));
  EXPECT_THAT(report_of(*outcome, "pose_5").remarks, testing::ElementsAre(HasSubstr("10 % of the board's pixels")));
}

TEST(Calibrate, NamesPicturesOfWhichOneIsShifted) {
  Observations observations = see(true_rig(), true_poses(12));
  for (PoseObservation& pose : observations.poses) pose.views[0].shift_px = Eigen::Vector2d(0, 0);
  observations.poses[6].views[0].shift_px = Eigen::Vector2d(9, 0);
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_EQ(report_of(*outcome, "pose_6").fault, PoseFault::kMoved);
  EXPECT_THAT(report_of(*outcome, "pose_6").reason, HasSubstr("print moved by 9 px"));
}

TEST(Calibrate, NamesAPoseThatSomethingStoodBefore) {
  const RigModel truth = true_rig();
  Observations observations = see(truth, true_poses(12));
  SightOptions options;
  options.relief = [](int, const Eigen::Vector2d&) { return -60; };
  const Observations before = see(truth, true_poses(12), options);
  for (std::size_t i = 0; i < 60; ++i) {
    observations.poses[4].views[0].symbols[i] = before.poses[4].views[0].symbols[i];
  }
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_EQ(report_of(*outcome, "pose_4").fault, PoseFault::kCovered) << report_of(*outcome, "pose_4").reason;
  EXPECT_THAT(report_of(*outcome, "pose_4").reason, HasSubstr("60 mm in front of it"));
  expect_near_truth(*outcome, truth);
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
  EXPECT_THAT(report_of(*outcome, "pose_7").reason, HasSubstr("11 corners found lie along one line"));
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
