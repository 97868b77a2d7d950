// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd {

/// The numbers that stand for a rotation, after x y z or as a whole matrix. Products apply from right to left.
enum class TurnNumbers {
  kVector,        ///< axis times angle
  kZyx,           ///< about z, the turned y, the turned x: Rz(first) Ry(second) Rx(third)
  kXyz,           ///< about the fixed x, y, z: Rz(third) Ry(second) Rx(first)
  kXyzTurned,     ///< about x, the turned y, the turned z: Rx(first) Ry(second) Rz(third)
  kZyz,           ///< about z, the turned y, the turned z: Rz(first) Ry(second) Rz(third)
  kScalarFirst,   ///< unit quaternion w x y z
  kScalarLast,    ///< unit quaternion x y z w
  kMatrix,        ///< 4x4, row by row; the place stands in the last column
  kMatrixTurned,  ///< the same, column by column
};

/// Notation of a robot's poses: the units and the order of their numbers.
struct PoseNotation {
  TurnNumbers turn = TurnNumbers::kMatrix;
  double unit_mm = 1;   ///< length of one unit of x y z
  double unit_rad = 1;  ///< size of one unit of an angle; quaternions and matrices have none

  /// Count of numbers of a pose: 6, 7 or 16.
  [[nodiscard]] std::size_t count() const;
  friend bool operator==(const PoseNotation&, const PoseNotation&) = default;
};

/// The notation of a robot, by name: "ur" (x y z in m, rotation vector in rad), "ur-pendant" (the same in mm), "kuka"
/// (x y z in mm, A B C in degrees), "fanuc" (x y z in mm, W P R in degrees), "staubli" (x y z in mm, Rx Ry Rz in
/// degrees), "kawasaki" (x y z in mm, O A T in degrees), "abb" (x y z in mm, q1 to q4), "ros" (x y z in m, quaternion x
/// y z w), "matrix" (4x4, mm), "matrix-m" (4x4, m).
/// @errors kInvalidArgument: the message lists the names
/// @thread reentrant
[[nodiscard]] Result<PoseNotation> pose_notation(std::string_view name);
[[nodiscard]] const std::vector<std::string>& pose_notation_names();

/// The name of a notation; empty if it has none.
[[nodiscard]] std::string name_of(const PoseNotation& notation);

/// Describes units and order: "x y z in mm, A B C in degrees (about z, the turned y, the turned x)".
[[nodiscard]] std::string describe(const PoseNotation& notation);

/// base_from_flange from a robot's numbers.
/// @errors kMalformed: another count, a number that is not finite, a quaternion or matrix that is no rotation
/// @thread reentrant
[[nodiscard]] Result<RigidTransform> read_robot_pose(std::span<const double> numbers, const PoseNotation& notation);

/// Refuses a place that no robot reaches. Its numbers are of another unit, or of other frames.
/// @errors kMismatch: the flange is nearer than 10 mm to the base, or further than 20 m
/// @thread reentrant
[[nodiscard]] Result<> check_reach(const RigidTransform& base_from_flange);

/// The numbers that read_robot_pose() reads.
/// @thread reentrant
[[nodiscard]] std::vector<double> robot_numbers(const RigidTransform& base_from_flange, const PoseNotation& notation);

}  // namespace slsd
