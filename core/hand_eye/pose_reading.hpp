// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/geometry/robot_pose.hpp"
#include "core/hand_eye/hand_eye_model.hpp"

namespace slsd {

/// One view as it was recorded.
struct RecordedView {
  std::string name;
  std::vector<double> pose;  ///< the robot's numbers
  LocatedBoard board;
};

/// A session as it was recorded.
struct HandEyeRecord {
  Mounted mounted = Mounted::kArm;
  PoseNotation notation;
  std::vector<RecordedView> views;  ///< in the order in which they were taken
  SharedErrors shared;
  double corner_px = 0.05;                     ///< one standard deviation of a corner's coordinate
  std::optional<Eigen::Vector3d> measured_mm;  ///< place of the scanner on the arm by a ruler
};

/// One way to understand a record. By default, the way that its user told.
struct PoseReading {
  enum class Mirror {
    kNone,
    kAxis,   ///< the robot's frames are left-handed: y has the wrong sign
    kTurns,  ///< the turns have the opposite sense, places are right
  };
  Mounted mounted = Mounted::kArm;
  PoseNotation notation;
  bool inverted = false;  ///< the poses are flange_from_base
  Mirror mirror = Mirror::kNone;
  std::vector<std::size_t> order;  ///< line of each view; a view with kNoLine has none; empty: its own line
  static constexpr std::size_t kNoLine = static_cast<std::size_t>(-1);
};

[[nodiscard]] PoseReading as_told(const HandEyeRecord& record);

/// All ways to understand the same numbers that differ from what the user told in units, order of numbers, direction,
/// handedness or mounting.
[[nodiscard]] std::vector<PoseReading> other_readings(const HandEyeRecord& record);

/// Lines of the views by the turns between them, which are the same for robot and board whatever else is wrong. Empty
/// if no order fits, or if the order is the record's own.
[[nodiscard]] std::vector<std::size_t> order_by_turns(const HandEyeSession& session);

/// The session in one reading.
/// @errors those of read_robot_pose(), with the view's name
/// @thread reentrant
[[nodiscard]] Result<HandEyeSession> read_session(const HandEyeRecord& record, const PoseReading& reading);

/// A wrong thing in the record, and what to do about it.
struct HandEyeFinding {
  enum class Fault {
    kTooFewPoses,
    kUnits,
    kAngleUnits,
    kTurnOrder,
    kInverted,
    kMirrored,
    kMounted,
    kPoseOrder,
    kLate,
    kCopied,
    kStray,
    kBoardMoved,
    kScannerKnocked,
    kTool,
    kUnrelated,
    kOneAxis,
    kLittleMotion,
  };
  Fault fault;
  std::string text;
};

/// Faults of the told reading if another one is right.
[[nodiscard]] std::vector<HandEyeFinding> differences(const HandEyeRecord& record, const PoseReading& reading);

}  // namespace slsd
