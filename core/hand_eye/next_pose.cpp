// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/next_pose.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "core/hand_eye/hand_eye_verdict.hpp"

namespace slsd {
namespace {

constexpr std::array<double, 2> kDistances{0.8, 1.2};  // shares of the working distance
constexpr std::array<double, 3> kRollsRad{-1, 0, 1};
constexpr double kTiltRad = 0.6;
constexpr int kTiltSides = 6;
constexpr double kSeenShare = 0.8;  // of the board's points, at least

RigidTransform view_of_board(const Board& board, double distance_mm, int side, double roll_rad) {
  const double direction = 2 * std::numbers::pi * side / kTiltSides;
  const Eigen::Vector3d axis(std::cos(direction), std::sin(direction), 0);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                               Eigen::AngleAxisd(kTiltRad, axis).toRotationMatrix();
  const Eigen::Vector3d middle(board.width_mm() / 2, board.height_mm() / 2, 0);
  return {turn, Eigen::Vector3d(0, 0, distance_mm) - turn * middle};
}

/// The board as the cameras would locate it; nothing if the first sees too little of it.
std::optional<LocatedBoard> as_if_seen(const Calibration& calibration, const Board& board,
                                       const RigidTransform& rig_from_board) {
  const Lens& lens = calibration.cameras.front().lens;
  CameraSighting seen;
  for (int id = 0; id < board.point_count(); ++id) {
    const Eigen::Vector3d there = rig_from_board * board.point(id);
    if (there.z() <= 0) continue;
    const Eigen::Vector2d pixel = lens.project(there);
    const bool inside = pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < lens.width_px && pixel.y() < lens.height_px;
    if (inside) seen.sighting.points.push_back({id, pixel});
  }
  if (static_cast<double>(seen.sighting.points.size()) < kSeenShare * board.point_count()) return std::nullopt;
  const auto located = locate_board(std::span(&seen, 1), board, calibration);
  return located ? std::optional(*located) : std::nullopt;
}

void begin_from_nearest(const HandEyeSession& session, NextPose& next) {
  next.turn_rad = 2 * std::numbers::pi;
  for (std::size_t i = 0; i < session.views.size(); ++i) {
    const RigidTransform& other = session.views[i].base_from_flange;
    const Eigen::AngleAxisd turn(other.rotation.transpose() * next.base_from_flange.rotation);
    if (turn.angle() >= next.turn_rad) continue;
    next.from = i, next.turn_rad = turn.angle(), next.axis = turn.axis();
    next.move_mm = (next.base_from_flange.translation - other.translation).norm();
  }
}

}  // namespace

std::optional<NextPose> propose_pose(const HandEyeSession& session, const HandEyeFit& fit,
                                     const Calibration& calibration, const Board& board, double working_distance_mm) {
  std::optional<NextPose> best;
  HandEyeSession with = session;
  with.views.emplace_back();
  for (const double share : kDistances) {
    for (int side = 0; side < kTiltSides; ++side) {
      for (const double roll : kRollsRad) {
        const RigidTransform view = view_of_board(board, share * working_distance_mm, side, roll);
        const auto seen = as_if_seen(calibration, board, view);
        if (!seen) continue;
        const RigidTransform robot = fit.places.mount_from_rig.after(view).after(fit.places.stand_from_board.inverse());
        const RigidTransform pose = session.mounted == Mounted::kArm ? robot.inverse() : robot;
        with.views.back() = {"next", *seen, pose};
        const double error_mm = judge_hand_eye(fit_hand_eye(with), working_distance_mm).error_mm;
        if (!best || error_mm < best->error_mm) best = NextPose{pose, error_mm, 0, Eigen::Vector3d::UnitZ(), 0, 0};
      }
    }
  }
  if (best) begin_from_nearest(session, *best);
  return best;
}

std::string describe(const NextPose& next, const HandEyeSession& session) {
  return fmt::format("from {}, turn the flange by {:.0f}° about ({:.2f}, {:.2f}, {:.2f}) and move it by {:.0f} mm",
                     session.views[next.from].name, next.turn_rad * 180 / std::numbers::pi, next.axis.x(),
                     next.axis.y(), next.axis.z(), next.move_mm);
}

}  // namespace slsd
