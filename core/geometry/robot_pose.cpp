// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/robot_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace slsd {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMetreMm = 1000;
constexpr double kUnitMax = 0.01;                        // pendants show three or four decimals
constexpr double kNearestMm = 10, kFarthestMm = 20'000;  // of a flange from its base, with room to spare

struct NamedNotation {
  const char* name;
  PoseNotation notation;
};

const std::array<NamedNotation, 10> kNotations{{
    {"ur", {TurnNumbers::kVector, kMetreMm, 1}},
    {"ur-pendant", {TurnNumbers::kVector, 1, 1}},
    {"kuka", {TurnNumbers::kZyx, 1, kDegree}},
    {"fanuc", {TurnNumbers::kXyz, 1, kDegree}},
    {"staubli", {TurnNumbers::kXyzTurned, 1, kDegree}},
    {"kawasaki", {TurnNumbers::kZyz, 1, kDegree}},
    {"abb", {TurnNumbers::kScalarFirst, 1, 1}},
    {"ros", {TurnNumbers::kScalarLast, kMetreMm, 1}},
    {"matrix", {TurnNumbers::kMatrix, 1, 1}},
    {"matrix-m", {TurnNumbers::kMatrix, kMetreMm, 1}},
}};

Eigen::Matrix3d about(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

Eigen::Matrix3d euler(double about_z_rad, double about_y_rad, double about_x_rad) {
  return about(Eigen::Vector3d::UnitZ(), about_z_rad) * about(Eigen::Vector3d::UnitY(), about_y_rad) *
         about(Eigen::Vector3d::UnitX(), about_x_rad);
}

Eigen::Matrix3d turn_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle > 0 ? about(vector / angle, angle) : Eigen::Matrix3d::Identity();
}

// z, y, x: euler() of these is the rotation.
Eigen::Vector3d euler_angles(const Eigen::Matrix3d& r) {
  const double across = std::hypot(r(0, 0), r(1, 0));
  if (across < 1e-9) return {0, std::atan2(-r(2, 0), across), std::atan2(-r(1, 2), r(1, 1))};
  return {std::atan2(r(1, 0), r(0, 0)), std::atan2(-r(2, 0), across), std::atan2(r(2, 1), r(2, 2))};
}

Result<Eigen::Matrix3d> read_quaternion(const Eigen::Quaterniond& quaternion) {
  if (std::abs(quaternion.norm() - 1) > kUnitMax) {
    return fail(
        ErrorCode::kMalformed,
        fmt::format("the quaternion has length {:.3f} instead of 1: another order or notation?", quaternion.norm()));
  }
  return quaternion.normalized().toRotationMatrix();
}

Result<RigidTransform> read_matrix(const Eigen::Matrix4d& matrix, double unit_mm) {
  const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
  const bool is_motion = (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() <= kUnitMax;
  if (!is_motion || (turn * turn.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kUnitMax)
    return fail(ErrorCode::kMalformed, "the matrix is no rotation with a place in its last column");
  if (turn.determinant() < 0) return fail(ErrorCode::kMalformed, "the matrix mirrors: one axis has the wrong sign");
  const Eigen::Quaterniond nearest(turn);
  return RigidTransform{nearest.normalized().toRotationMatrix(), unit_mm * matrix.topRightCorner<3, 1>()};
}

Result<Eigen::Matrix3d> read_turn(std::span<const double> n, const PoseNotation& notation) {
  const double unit = notation.unit_rad;
  switch (notation.turn) {
    case TurnNumbers::kVector:
      return turn_by(unit * Eigen::Vector3d(n[0], n[1], n[2]));
    case TurnNumbers::kZyx:
      return euler(unit * n[0], unit * n[1], unit * n[2]);
    case TurnNumbers::kXyz:
      return euler(unit * n[2], unit * n[1], unit * n[0]);
    case TurnNumbers::kXyzTurned:
      return euler(-unit * n[2], -unit * n[1], -unit * n[0]).transpose();
    case TurnNumbers::kZyz:
      return euler(unit * n[0], unit * n[1], 0) * about(Eigen::Vector3d::UnitZ(), unit * n[2]);
    case TurnNumbers::kScalarFirst:
      return read_quaternion({n[0], n[1], n[2], n[3]});
    default:
      return read_quaternion({n[3], n[0], n[1], n[2]});
  }
}

}  // namespace

std::size_t PoseNotation::count() const {
  switch (turn) {
    case TurnNumbers::kVector:
    case TurnNumbers::kZyx:
    case TurnNumbers::kXyz:
    case TurnNumbers::kXyzTurned:
    case TurnNumbers::kZyz:
      return 6;
    case TurnNumbers::kScalarFirst:
    case TurnNumbers::kScalarLast:
      return 7;
    case TurnNumbers::kMatrix:
    case TurnNumbers::kMatrixTurned:
      break;
  }
  return 16;
}

const std::vector<std::string>& pose_notation_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const NamedNotation& each : kNotations) list.emplace_back(each.name);
    return list;
  }();
  return names;
}

Result<PoseNotation> pose_notation(std::string_view name) {
  for (const NamedNotation& each : kNotations)
    if (each.name == name) return each.notation;
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("is no notation of poses: {}", fmt::join(pose_notation_names(), ", ")), std::string(name));
}

std::string name_of(const PoseNotation& notation) {
  for (const NamedNotation& each : kNotations)
    if (each.notation == notation) return each.name;
  return {};
}

std::string describe(const PoseNotation& notation) {
  const std::string place = notation.unit_mm == 1          ? "mm"
                            : notation.unit_mm == kMetreMm ? "m"
                                                           : fmt::format("units of {:g} mm", notation.unit_mm);
  const std::string angle = notation.unit_rad == 1 ? "radians" : "degrees";
  const auto with_place = [&](const std::string& turn) { return "x y z in " + place + ", " + turn; };
  switch (notation.turn) {
    case TurnNumbers::kVector:
      return with_place("rotation vector in " + angle);
    case TurnNumbers::kZyx:
      return with_place("A B C in " + angle + " (about z, the turned y, the turned x)");
    case TurnNumbers::kXyz:
      return with_place("W P R in " + angle + " (about the fixed x, y, z)");
    case TurnNumbers::kXyzTurned:
      return with_place("Rx Ry Rz in " + angle + " (about x, the turned y, the turned z)");
    case TurnNumbers::kZyz:
      return with_place("O A T in " + angle + " (about z, the turned y, the turned z)");
    case TurnNumbers::kScalarFirst:
      return with_place("quaternion w x y z");
    case TurnNumbers::kScalarLast:
      return with_place("quaternion x y z w");
    case TurnNumbers::kMatrix:
      return "4x4 matrix, row by row, in " + place;
    case TurnNumbers::kMatrixTurned:
      break;
  }
  return "4x4 matrix, column by column, in " + place;
}

Result<RigidTransform> read_robot_pose(std::span<const double> numbers, const PoseNotation& notation) {
  if (numbers.size() != notation.count()) {
    return fail(ErrorCode::kMalformed,
                fmt::format("has {} numbers instead of {}: {}", numbers.size(), notation.count(), describe(notation)));
  }
  if (!std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); }))
    return fail(ErrorCode::kMalformed, "has a number that is not finite: the robot gave no pose");
  if (numbers.size() == 16) {
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> rows(numbers.data());
    const bool turned = notation.turn == TurnNumbers::kMatrixTurned;
    return read_matrix(turned ? Eigen::Matrix4d(rows.transpose()) : Eigen::Matrix4d(rows), notation.unit_mm);
  }
  const auto turn = read_turn(numbers.subspan(3), notation);
  if (!turn) return tl::unexpected(turn.error());
  return RigidTransform{*turn, notation.unit_mm * Eigen::Vector3d(numbers[0], numbers[1], numbers[2])};
}

Result<> check_reach(const RigidTransform& base_from_flange) {
  const double distance_mm = base_from_flange.translation.norm();
  if (distance_mm >= kNearestMm && distance_mm <= kFarthestMm) return {};
  return fail(ErrorCode::kMismatch,
              fmt::format("puts the flange {:.4g} mm from the robot's base, which must be {:g} mm to {:g} m",
                          distance_mm, kNearestMm, kFarthestMm / kMetreMm));
}

std::vector<double> robot_numbers(const RigidTransform& pose, const PoseNotation& notation) {
  const Eigen::Vector3d place = pose.translation / notation.unit_mm;
  if (notation.count() == 16) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = pose.rotation;
    matrix.topRightCorner<3, 1>() = place;
    if (notation.turn == TurnNumbers::kMatrix) matrix.transposeInPlace();  // Eigen stores columns
    return {matrix.data(), matrix.data() + matrix.size()};
  }
  std::vector<double> numbers{place.x(), place.y(), place.z()};
  const auto add = [&](std::initializer_list<double> turn) { numbers.insert(numbers.end(), turn); };
  const double unit = notation.unit_rad;
  const Eigen::Quaterniond q(pose.rotation);
  const Eigen::AngleAxisd axis(pose.rotation);
  const Eigen::Vector3d angles = euler_angles(pose.rotation) / unit, vector = axis.angle() / unit * axis.axis();
  switch (notation.turn) {
    case TurnNumbers::kVector:
      add({vector.x(), vector.y(), vector.z()});
      break;
    case TurnNumbers::kZyx:
      add({angles.x(), angles.y(), angles.z()});
      break;
    case TurnNumbers::kXyz:
      add({angles.z(), angles.y(), angles.x()});
      break;
    case TurnNumbers::kXyzTurned: {
      const Eigen::Vector3d back = -euler_angles(pose.rotation.transpose()) / unit;
      add({back.z(), back.y(), back.x()});
      break;
    }
    case TurnNumbers::kZyz: {
      const Eigen::Vector3d zyz = pose.rotation.eulerAngles(2, 1, 2) / unit;
      add({zyz.x(), zyz.y(), zyz.z()});
      break;
    }
    case TurnNumbers::kScalarFirst:
      add({q.w(), q.x(), q.y(), q.z()});
      break;
    default:
      add({q.x(), q.y(), q.z(), q.w()});
  }
  return numbers;
}

}  // namespace slsd
