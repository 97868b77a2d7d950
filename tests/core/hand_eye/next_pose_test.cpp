// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/next_pose.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "core/hand_eye/hand_eye_verdict.hpp"
#include "tests/core/hand_eye/simulated_robot.hpp"

namespace slsd {
namespace {

constexpr double kAtMm = 1000;

/// Takes a view at the pose, as the simulated robot would.
void take(SimulatedSession& simulated, const RigidTransform& base_from_flange, std::mt19937& random) {
  const RigidTransform view = simulated.places.mount_from_rig.inverse()
                                  .after(mount_from_stand(simulated.session.mounted, base_from_flange))
                                  .after(simulated.places.stand_from_board);
  const auto seen = look_at_board(simulated.truth, simulated.board, view, 0.05, random);
  const auto located = locate_board(seen, simulated.board, simulated.calibration);
  ASSERT_TRUE(located) << to_string(located.error());
  simulated.session.views.push_back({"next", *located, base_from_flange});
}

TEST(ProposePose, AddsTheMotionThatIsMissing) {
  for (const Mounted mounted : {Mounted::kArm, Mounted::kCell}) {
    SimulatedRobot robot;
    robot.mounted = mounted, robot.poses = 8;
    robot.turn_max_rad = 0.05, robot.roll_max_rad = 0.4;  // hardly tilted
    SimulatedSession simulated = simulate(robot, 3);
    std::mt19937 random(1);
    double before = judge_hand_eye(fit_hand_eye(simulated.session), kAtMm).error_mm;
    for (int i = 0; i < 2; ++i) {
      const HandEyeFit fit = fit_hand_eye(simulated.session);
      const auto next = propose_pose(simulated.session, fit, simulated.calibration, simulated.board, kAtMm);
      ASSERT_TRUE(next);
      EXPECT_LT(next->error_mm, before);
      EXPECT_GT(next->turn_rad, 0.2);
      EXPECT_THAT(describe(*next, simulated.session), testing::ContainsRegex("from [a-z0-9_]+, turn the flange by"));
      take(simulated, next->base_from_flange, random);
      if (HasFatalFailure()) return;
    }
    EXPECT_LT(judge_hand_eye(fit_hand_eye(simulated.session), kAtMm).error_mm, 0.5 * before);
  }
}

// Corners without noise, as proposals have them, are a special case for the first guess.
TEST(LocateBoard, LocatesExactCorners) {
  const SimulatedSession simulated = simulate({}, 3);
  const Eigen::Vector3d middle(simulated.board.width_mm() / 2, simulated.board.height_mm() / 2, 0);
  std::mt19937 random(1);
  int located = 0;
  for (int i = 0; i < 36; ++i) {
    const double side = i % 6 * 1.0471975512, distance_mm = i < 18 ? 800 : 1200;
    const Eigen::Matrix3d turn =
        turned_by({0, 0, i / 6 % 3 - 1.0}) * turned_by({0.6 * std::cos(side), 0.6 * std::sin(side), 0});
    const RigidTransform view{turn, Eigen::Vector3d(0, 0, distance_mm) - turn * middle};
    const auto seen = look_at_board(simulated.calibration, simulated.board, view, 0, random);
    const auto board = locate_board(seen, simulated.board, simulated.calibration);
    if (!board) continue;
    EXPECT_TRUE(board->normal.allFinite() && board->rig_from_board.translation.allFinite());
    located += (board->rig_from_board.translation - view.translation).norm() < 1e-3;
  }
  EXPECT_GE(located, 34);
}

}  // namespace
}  // namespace slsd
