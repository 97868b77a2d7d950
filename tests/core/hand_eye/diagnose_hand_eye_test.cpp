// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Planted faults, each named, and faultless sessions, which are not accused.
#include "core/hand_eye/diagnose_hand_eye.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/hand_eye/simulated_robot.hpp"

namespace slsd {
namespace {

using Fault = HandEyeFinding::Fault;
using testing::HasSubstr;

constexpr double kRadOfDegree = 0.017453292519943295;
constexpr double kWorkingMm = 1000;

/// A simulated session as a robot writes it down.
class Recorded {
 public:
  Recorded(const SimulatedRobot& robot, unsigned seed, const char* notation = "kuka")
      : simulated_(simulate(robot, seed)), random_(seed) {
    record.mounted = robot.mounted;
    record.notation = *pose_notation(notation);
    for (const HandEyeView& view : simulated_.session.views)
      record.views.push_back({view.name, robot_numbers(view.base_from_flange, record.notation), view.board});
    record.shared = simulated_.session.shared;
    record.corner_px = simulated_.session.corner_px;
  }

  /// Writes other poses down.
  void rewrite(const std::function<RigidTransform(std::size_t, const RigidTransform&)>& change) {
    for (std::size_t i = 0; i < record.views.size(); ++i) {
      const RigidTransform pose = change(i, simulated_.session.views[i].base_from_flange);
      record.views[i].pose = robot_numbers(pose, record.notation);
    }
  }

  /// Takes the pictures again from one view on, with scanner or board moved where they sit.
  void move_from(std::size_t first, const RigidTransform& scanner, const RigidTransform& board) {
    for (std::size_t i = first; i < record.views.size(); ++i) {
      const RigidTransform robot = mount_from_stand(record.mounted, simulated_.base_from_flange[i]);
      const RigidTransform rig_from_board =
          simulated_.places.mount_from_rig.after(scanner).inverse().after(robot).after(board).after(
              simulated_.places.stand_from_board);
      const auto seen = look_at_board(simulated_.truth, simulated_.board, rig_from_board, 0.05, random_);
      record.views[i].board = *locate_board(seen, simulated_.board, simulated_.calibration);
    }
  }

  void reorder(const std::vector<std::size_t>& lines) {
    const std::vector<RecordedView> before = record.views;
    for (std::size_t i = 0; i < lines.size(); ++i) record.views[i].pose = before[lines[i]].pose;
  }

  [[nodiscard]] const SimulatedSession& simulated() const { return simulated_; }

  HandEyeRecord record;

 private:
  SimulatedSession simulated_;
  std::mt19937 random_;
};

std::vector<Fault> faults_of(const HandEyeResult& result) {
  std::vector<Fault> faults;
  for (const HandEyeFinding& finding : result.findings) faults.push_back(finding.fault);
  return faults;
}

/// Plants a fault into sessions of arm and cell, with the noise of a usual robot.
void expect_named(Fault fault, const std::function<void(Recorded&)>& plant, const SimulatedRobot& like = {}) {
  for (const Mounted mounted : {Mounted::kArm, Mounted::kCell}) {
    for (unsigned seed = 0; seed < 2; ++seed) {
      SimulatedRobot robot = like;
      robot.mounted = mounted, robot.noise = {0.1, 0.05 * kRadOfDegree};
      Recorded recorded(robot, 500 + seed);
      plant(recorded);
      const auto result = diagnose_hand_eye(recorded.record, kWorkingMm);
      ASSERT_TRUE(result) << to_string(result.error());
      EXPECT_THAT(faults_of(*result), testing::ElementsAre(fault))
          << (mounted == Mounted::kArm ? "arm, seed " : "cell, seed ") << seed << ": "
          << (result->findings.empty() ? "nothing found" : result->findings.front().text);
    }
  }
}

/// Sessions without a fault, of a good and of a usual robot in turn.
void expect_faultless(Mounted mounted) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SimulatedRobot robot;
    robot.mounted = mounted;
    if (seed % 2 == 1) robot.noise = {0.1, 0.05 * kRadOfDegree};
    const auto result = diagnose_hand_eye(Recorded(robot, 700 + seed).record, kWorkingMm);
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->findings.empty()) << seed << ": " << result->findings.front().text;
    EXPECT_NE(grade(result->verdict), HandEyeGrade::kBad) << seed << ": " << result->verdict.error_mm;
  }
}

TEST(DiagnoseHandEye, FindsNothingInFaultlessSessionsOfAnArm) {
  expect_faultless(Mounted::kArm);
}

TEST(DiagnoseHandEye, FindsNothingInFaultlessSessionsOfACell) {
  expect_faultless(Mounted::kCell);
}

TEST(DiagnoseHandEye, NamesWrongUnits) {
  expect_named(Fault::kUnits, [](Recorded& recorded) { recorded.record.notation.unit_mm = 1000; });
}

TEST(DiagnoseHandEye, NamesDegreesForRadians) {
  expect_named(Fault::kAngleUnits, [](Recorded& recorded) { recorded.record.notation.unit_rad = 1; });
}

TEST(DiagnoseHandEye, NamesAWrongOrderOfAngles) {
  expect_named(Fault::kTurnOrder, [](Recorded& recorded) { recorded.record.notation = *pose_notation("fanuc"); });
}

TEST(DiagnoseHandEye, NamesAWrongOrderOfAQuaternion) {
  SimulatedRobot robot;
  Recorded recorded(robot, 1, "abb");
  recorded.record.notation.turn = TurnNumbers::kScalarLast;
  const auto result = diagnose_hand_eye(recorded.record, kWorkingMm);
  ASSERT_TRUE(result);
  ASSERT_THAT(faults_of(*result), testing::ElementsAre(Fault::kTurnOrder));
  EXPECT_THAT(result->findings.front().text, HasSubstr("--poses abb"));
}

TEST(DiagnoseHandEye, NamesInvertedPoses) {
  expect_named(Fault::kInverted, [](Recorded& recorded) {
    recorded.rewrite([](std::size_t, const RigidTransform& pose) { return pose.inverse(); });
  });
}

TEST(DiagnoseHandEye, NamesMirroredPoses) {
  expect_named(Fault::kMirrored, [](Recorded& recorded) {
    recorded.rewrite([](std::size_t, const RigidTransform& pose) {
      const Eigen::DiagonalMatrix<double, 3> axis(-1, 1, 1);
      return RigidTransform{axis * pose.rotation * axis, axis * pose.translation};
    });
  });
}

TEST(DiagnoseHandEye, NamesAWrongMounting) {
  expect_named(Fault::kMounted, [](Recorded& recorded) {
    recorded.record.mounted = recorded.record.mounted == Mounted::kArm ? Mounted::kCell : Mounted::kArm;
  });
}

TEST(DiagnoseHandEye, NamesShuffledPoses) {
  expect_named(Fault::kPoseOrder, [](Recorded& recorded) {
    std::vector<std::size_t> lines(recorded.record.views.size());
    std::iota(lines.begin(), lines.end(), 0);
    std::shuffle(lines.begin(), lines.end(), std::mt19937(1));
    recorded.reorder(lines);
  });
}

TEST(DiagnoseHandEye, NamesPosesOneViewTooLate) {
  expect_named(Fault::kPoseOrder, [](Recorded& recorded) {
    const std::size_t count = recorded.record.views.size();
    const std::vector<double> somewhere = robot_numbers(
        recorded.simulated().session.views[0].base_from_flange.after({turned_by({0.3, 0.2, 0.1}), {50, 0, 80}}),
        recorded.record.notation);
    std::vector<std::size_t> lines(count, 0);
    for (std::size_t i = 1; i < count; ++i) lines[i] = i - 1;
    recorded.reorder(lines);
    recorded.record.views[0].pose = somewhere;
  });
}

TEST(DiagnoseHandEye, NamesPosesReadOnTheWay) {
  expect_named(Fault::kLate, [](Recorded& recorded) {
    RigidTransform before;
    recorded.rewrite([&](std::size_t i, const RigidTransform& pose) {
      const RigidTransform start = i == 0 ? pose : before;
      before = pose;
      const Eigen::Quaterniond there(pose.rotation), from(start.rotation);
      return RigidTransform{there.slerp(0.2, from).toRotationMatrix(),
                            pose.translation + 0.2 * (start.translation - pose.translation)};
    });
  });
}

TEST(DiagnoseHandEye, NamesACopiedPose) {
  expect_named(Fault::kCopied,
               [](Recorded& recorded) { recorded.record.views[5].pose = recorded.record.views[4].pose; });
}

TEST(DiagnoseHandEye, NamesCopiesOfTwoPoses) {
  expect_named(Fault::kCopied, [](Recorded& recorded) {
    for (std::size_t i = 2; i < recorded.record.views.size(); ++i)
      recorded.record.views[i].pose = recorded.record.views[i % 2].pose;
  });
}

TEST(DiagnoseHandEye, NamesAPoseThatContradictsTheOthers) {
  expect_named(Fault::kStray, [](Recorded& recorded) {
    recorded.rewrite([](std::size_t i, const RigidTransform& pose) {
      return i == 6 ? RigidTransform{turned_by({0.02, 0, 0.01}) * pose.rotation,
                                     pose.translation + Eigen::Vector3d(8, -5, 3)}
                    : pose;
    });
  });
}

TEST(DiagnoseHandEye, NamesABoardThatMoved) {
  const RigidTransform move{turned_by({0.005, -0.003, 0.01}), {4, -3, 2}};
  expect_named(Fault::kBoardMoved, [&](Recorded& recorded) { recorded.move_from(7, {}, move); });
}

TEST(DiagnoseHandEye, NamesAKnockedScanner) {
  const RigidTransform move{turned_by({0.01, 0.004, -0.006}), {0.5, 2, -1}};
  expect_named(Fault::kScannerKnocked, [&](Recorded& recorded) { recorded.move_from(7, move, {}); });
}

TEST(DiagnoseHandEye, NamesAToolInsteadOfTheFlange) {
  const RigidTransform tool{Eigen::Matrix3d::Identity(), {0, 0, 180}};
  expect_named(Fault::kTool, [&](Recorded& recorded) {
    recorded.rewrite([&](std::size_t i, const RigidTransform& pose) { return i < 5 ? pose : pose.after(tool); });
  });
}

TEST(DiagnoseHandEye, NamesAToolByTheMeasuredPlaceOfTheScanner) {
  const RigidTransform tool{Eigen::Matrix3d::Identity(), {0, 0, 180}};
  for (unsigned seed = 0; seed < 5; ++seed) {
    Recorded recorded({}, 300 + seed);
    recorded.record.measured_mm = recorded.simulated().places.mount_from_rig.translation + Eigen::Vector3d(10, -15, 10);
    const auto good = diagnose_hand_eye(recorded.record, kWorkingMm);
    ASSERT_TRUE(good);
    EXPECT_TRUE(good->findings.empty()) << good->findings.front().text;
    recorded.rewrite([&](std::size_t, const RigidTransform& pose) { return pose.after(tool); });
    const auto result = diagnose_hand_eye(recorded.record, kWorkingMm);
    ASSERT_TRUE(result);
    EXPECT_THAT(faults_of(*result), testing::ElementsAre(Fault::kTool));
  }
}

TEST(DiagnoseHandEye, NamesTurnsAboutOneAxis) {
  expect_named(Fault::kOneAxis, [](Recorded&) {}, {.one_axis = true});
}

TEST(DiagnoseHandEye, NamesTooLittleMotion) {
  expect_named(Fault::kLittleMotion, [](Recorded&) {}, {.turn_max_rad = 0.02, .roll_max_rad = 0.02});
}

TEST(DiagnoseHandEye, NamesPosesOfAnotherArm) {
  expect_named(Fault::kUnrelated, [](Recorded& recorded) {
    SimulatedRobot other;
    other.mounted = recorded.record.mounted;
    const SimulatedSession simulated = simulate(other, 99);
    recorded.rewrite([&](std::size_t i, const RigidTransform&) { return simulated.session.views[i].base_from_flange; });
  });
}

TEST(DiagnoseHandEye, NamesTooFewPoses) {
  expect_named(Fault::kTooFewPoses, [](Recorded& recorded) { recorded.record.views.resize(2); });
}

TEST(DiagnoseHandEye, RefusesANumberThatIsNotFinite) {
  Recorded recorded({}, 1);
  recorded.record.views[3].pose[1] = std::numeric_limits<double>::quiet_NaN();
  const auto result = diagnose_hand_eye(recorded.record, kWorkingMm);
  ASSERT_FALSE(result);
  EXPECT_THAT(to_string(result.error()), HasSubstr("pose_03: has a number that is not finite"));
}

}  // namespace
}  // namespace slsd
