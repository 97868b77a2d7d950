// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/first_places.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace slsd {
namespace {

// Both halves of a quaternion's double cover are the same rotation; the scalar tells which half is meant.
Eigen::Quaterniond positive(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q;
}

// a q = q b, as a linear equation in q = (x, y, z, w).
Eigen::Matrix4d left_minus_right(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  Eigen::Matrix4d difference;
  for (int i = 0; i < 4; ++i) {
    Eigen::Quaterniond unit(0, 0, 0, 0);
    unit.coeffs()[i] = 1;
    difference.col(i) = (a * unit).coeffs() - (unit * b).coeffs();
  }
  return difference;
}

}  // namespace

RigidTransform mean_of(std::span<const RigidTransform> motions) {
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  Eigen::Vector3d places = Eigen::Vector3d::Zero();
  for (const RigidTransform& each : motions) turns += each.rotation, places += each.translation;
  const Eigen::JacobiSVD<Eigen::Matrix3d> parts(turns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d signs = Eigen::Matrix3d::Identity();
  signs(2, 2) = (parts.matrixU() * parts.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return {parts.matrixU() * signs * parts.matrixV().transpose(), places / static_cast<double>(motions.size())};
}

HandEyePlaces first_places(Mounted mounted, std::span<const HandEyeView* const> views) {
  std::vector<RigidTransform> robot;
  for (const HandEyeView* view : views) robot.push_back(mount_from_stand(mounted, view->base_from_flange));
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Quaterniond of_robot = positive(robot[i].rotation * robot[j].rotation.transpose());
      const Eigen::Quaterniond of_board =
          positive(views[i]->board.rig_from_board.rotation * views[j]->board.rig_from_board.rotation.transpose());
      const Eigen::Matrix4d equation = left_minus_right(of_robot, of_board);
      squares += equation.transpose() * equation;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> least(squares);
  Eigen::Quaterniond turn;
  turn.coeffs() = least.eigenvectors().col(0);
  HandEyePlaces places;
  places.mount_from_rig.rotation = turn.normalized().toRotationMatrix();
  // mount_from_rig * rig_from_board = mount_from_stand * stand_from_board, in the places
  const auto rows = static_cast<Eigen::Index>(3 * views.size());
  Eigen::MatrixXd equations(rows, 6);
  Eigen::VectorXd right(rows);
  std::vector<RigidTransform> boards;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const RigidTransform& seen = views[i]->board.rig_from_board;
    const auto row = static_cast<Eigen::Index>(3 * i);
    equations.block<3, 3>(row, 0).setIdentity();
    equations.block<3, 3>(row, 3) = -robot[i].rotation;
    right.segment<3>(row) = robot[i].translation - places.mount_from_rig.rotation * seen.translation;
    boards.push_back({robot[i].rotation.transpose() * places.mount_from_rig.rotation * seen.rotation, {0, 0, 0}});
  }
  const Eigen::VectorXd both = equations.completeOrthogonalDecomposition().solve(right);
  places.stand_from_board = mean_of(boards);
  places.mount_from_rig.translation = both.head<3>();
  places.stand_from_board.translation = both.tail<3>();
  return places;
}

}  // namespace slsd
