// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/pose_reading.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace slsd {
namespace {

using Fault = HandEyeFinding::Fault;
using Mirror = PoseReading::Mirror;

constexpr double kDegreeRad = std::numbers::pi / 180;
constexpr double kMetreUnitMm = 1000;
constexpr double kOrderFitsRad = 0.02;  // far above a robot's noise, far below the turns between poses

std::vector<PoseNotation> notations_like(const PoseNotation& told) {
  std::vector<TurnNumbers> turns;
  std::vector<double> angles{1};
  switch (told.count()) {
    case 6:
      turns = {TurnNumbers::kVector, TurnNumbers::kZyx, TurnNumbers::kXyz, TurnNumbers::kXyzTurned, TurnNumbers::kZyz};
      angles = {1, kDegreeRad};
      break;
    case 7:
      turns = {TurnNumbers::kScalarFirst, TurnNumbers::kScalarLast};
      break;
    default:
      turns = {TurnNumbers::kMatrix, TurnNumbers::kMatrixTurned};
  }
  std::vector<PoseNotation> notations;
  for (const TurnNumbers turn : turns) {
    for (const double angle : angles) {
      for (const double unit_mm : {1.0, kMetreUnitMm}) notations.push_back({turn, unit_mm, angle});
    }
  }
  return notations;
}

RigidTransform mirrored(const RigidTransform& pose, Mirror mirror) {
  if (mirror == Mirror::kTurns) return {pose.rotation.transpose(), pose.translation};
  if (mirror == Mirror::kNone) return pose;
  const Eigen::DiagonalMatrix<double, 3> axis(1, -1, 1);
  return {axis * pose.rotation * axis, axis * pose.translation};
}

double turn_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a.transpose() * b).angle();
}

// Angles between all pairs.
template <class Rotation>
Eigen::MatrixXd turns_between(std::size_t count, const Rotation& rotation) {
  const auto size = static_cast<Eigen::Index>(count);
  Eigen::MatrixXd turns = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      turns(row, column) = turns(column, row) = turn_between(rotation(i), rotation(j));
    }
  }
  return turns;
}

// How far row i of one is from row j of the other, whatever the order of their columns.
double row_distance(const Eigen::MatrixXd& a, Eigen::Index i, const Eigen::MatrixXd& b, Eigen::Index j) {
  Eigen::VectorXd one = a.row(i), other = b.row(j);
  std::sort(one.data(), one.data() + one.size());
  std::sort(other.data(), other.data() + other.size());
  return (one - other).norm();
}

std::string told_name(const PoseNotation& notation) {
  const std::string name = name_of(notation);
  return name.empty() ? describe(notation) : "--poses " + name + " (" + describe(notation) + ")";
}

}  // namespace

PoseReading as_told(const HandEyeRecord& record) {
  PoseReading reading;
  reading.mounted = record.mounted;
  reading.notation = record.notation;
  return reading;
}

std::vector<PoseReading> other_readings(const HandEyeRecord& record) {
  std::vector<PoseReading> readings;
  for (const PoseNotation& notation : notations_like(record.notation)) {
    for (const Mounted mounted : {Mounted::kArm, Mounted::kCell}) {
      for (const bool inverted : {false, true}) {
        for (const Mirror mirror : {Mirror::kNone, Mirror::kAxis, Mirror::kTurns}) {
          const bool other = mounted != record.mounted;
          if (inverted && other) continue;  // the same motions as neither
          const bool told = notation == record.notation && !other && !inverted;
          if (!told || mirror != Mirror::kNone) readings.push_back({mounted, notation, inverted, mirror, {}});
        }
      }
    }
  }
  return readings;
}

std::vector<std::size_t> order_by_turns(const HandEyeSession& session) {
  const std::size_t count = session.views.size();
  const Eigen::MatrixXd robot =
      turns_between(count, [&](std::size_t i) { return session.views[i].base_from_flange.rotation; });
  const Eigen::MatrixXd board =
      turns_between(count, [&](std::size_t i) { return session.views[i].board.rig_from_board.rotation; });
  std::vector<std::size_t> order(count), left(count);
  std::iota(left.begin(), left.end(), 0);
  for (std::size_t view = 0; view < count; ++view) {
    const auto nearest = std::ranges::min_element(left, {}, [&](std::size_t line) {
      return row_distance(board, static_cast<Eigen::Index>(view), robot, static_cast<Eigen::Index>(line));
    });
    order[view] = *nearest;
    left.erase(nearest);
  }
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto at = [](std::size_t index) { return static_cast<Eigen::Index>(index); };
      squares += std::pow(board(at(i), at(j)) - robot(at(order[i]), at(order[j])), 2);
    }
  }
  const double pairs = 0.5 * static_cast<double>(count * (count - 1));
  if (std::sqrt(squares / pairs) > kOrderFitsRad || std::ranges::is_sorted(order)) return {};
  return order;
}

Result<HandEyeSession> read_session(const HandEyeRecord& record, const PoseReading& reading) {
  HandEyeSession session;
  session.mounted = reading.mounted;
  session.shared = record.shared;
  session.corner_px = record.corner_px;
  for (std::size_t i = 0; i < record.views.size(); ++i) {
    const std::size_t line = reading.order.empty() ? i : reading.order[i];
    HandEyeView view{record.views[i].name, record.views[i].board, {}};
    if (line != PoseReading::kNoLine) {
      const auto pose = read_robot_pose(record.views[line].pose, reading.notation);
      if (!pose) return fail(pose.error().code, pose.error().message, record.views[line].name);
      view.base_from_flange = mirrored(reading.inverted ? pose->inverse() : *pose, reading.mirror);
    }
    session.views.push_back(std::move(view));
  }
  return session;
}

std::vector<HandEyeFinding> differences(const HandEyeRecord& record, const PoseReading& reading) {
  std::vector<HandEyeFinding> found;
  const PoseNotation &told = record.notation, &is = reading.notation;
  const auto add = [&](Fault fault, std::string text) { found.push_back({fault, std::move(text)}); };
  const std::string use = ": use " + told_name(is);
  if (told.unit_mm != is.unit_mm) {
    const bool metres = is.unit_mm == kMetreUnitMm;
    add(Fault::kUnits, fmt::format("the poses are in {}, not in {}{}", metres ? "m" : "mm", metres ? "mm" : "m", use));
  }
  if (told.unit_rad != is.unit_rad) {
    const bool radians = is.unit_rad == 1;
    add(Fault::kAngleUnits, fmt::format("the angles are in {}, not in {}{}", radians ? "radians" : "degrees",
                                        radians ? "degrees" : "radians", use));
  }
  if (told.turn != is.turn) add(Fault::kTurnOrder, "the numbers of the turn have another order or meaning" + use);
  if (reading.inverted) add(Fault::kInverted, "the poses are inverted, base in flange: record the flange in the base");
  if (reading.mirror == Mirror::kAxis)
    add(Fault::kMirrored, "the poses are mirrored: an axis of the robot's frames has the wrong sign");
  if (reading.mirror == Mirror::kTurns)
    add(Fault::kMirrored, "the turns have the opposite sense: the signs of the angles are wrong, the places right");
  if (reading.mounted != record.mounted) {
    add(Fault::kMounted, reading.mounted == Mounted::kArm
                             ? "the scanner is on the arm and the board stands still: use --mounted arm"
                             : "the scanner stands in the cell and the board is on the arm: use --mounted cell");
  }
  if (!reading.order.empty()) {
    std::string pairs;
    for (std::size_t i = 0; i < reading.order.size() && pairs.size() < 80; ++i) {
      if (reading.order[i] == i || reading.order[i] == PoseReading::kNoLine) continue;
      pairs += fmt::format("{}{} belongs to the pose of {}", pairs.empty() ? "" : ", ", record.views[i].name,
                           record.views[reading.order[i]].name);
    }
    add(Fault::kPoseOrder, "the poses are in another order than the pictures: " + pairs);
  }
  return found;
}

}  // namespace slsd
