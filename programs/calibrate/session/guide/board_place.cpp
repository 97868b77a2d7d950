// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/board_place.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr double kFocalGuess = 1.2;  // relative to the image's longer side
constexpr double kCentreMoved = 1.0 / 6;
constexpr double kTilted = 8 * std::numbers::pi / 180;
constexpr double kTurned = 25 * std::numbers::pi / 180;
constexpr double kFarther = 1.12;

Eigen::Matrix3d guessed_inverse_lens(const ImageSize& size) {
  const double focal_px = kFocalGuess * std::max(size.width_px, size.height_px);
  Eigen::Matrix3d lens;
  lens << focal_px, 0, 0.5 * (size.width_px - 1), 0, focal_px, 0.5 * (size.height_px - 1), 0, 0, 1;
  return lens.inverse();
}

double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}

}  // namespace

double BoardPlace::tilt_deg() const {
  return std::acos(std::clamp(normal.z(), 0.0, 1.0)) * 180 / std::numbers::pi;
}

std::optional<BoardPlace> place_of(std::span<const Tie> ties, const Board& board, const ImageSize& size) {
  const auto homography = fit_homography(ties);
  if (!homography) return std::nullopt;
  const Eigen::Vector2d centre_mm = 0.5 * Eigen::Vector2d(board.width_mm(), board.height_mm());
  const Eigen::Vector2d pixel = homography->map(centre_mm);
  Eigen::Matrix3d pose = guessed_inverse_lens(size) * homography->matrix;
  const double scale = std::sqrt(pose.col(0).norm() * pose.col(1).norm());
  if (!(scale > 0) || !pixel.allFinite()) return std::nullopt;
  pose /= scale;
  Eigen::Vector3d normal = pose.col(0).cross(pose.col(1)).normalized();
  if (normal.z() < 0) normal = -normal;
  const Eigen::Vector3d centre = pose * centre_mm.homogeneous();
  const Eigen::Vector2d along = homography->jacobian(centre_mm).col(0);
  return BoardPlace{
      {pixel.x() / size.width_px, pixel.y() / size.height_px}, normal, centre.norm(), std::atan2(along.y(), along.x())};
}

bool are_alike(const BoardPlace& a, const BoardPlace& b) {
  const double turn = std::remainder(a.turn_rad - b.turn_rad, 2 * std::numbers::pi);
  const double ratio = std::max(a.distance_mm, b.distance_mm) / std::min(a.distance_mm, b.distance_mm);
  return (a.centre - b.centre).cwiseAbs().maxCoeff() < kCentreMoved && angle(a.normal, b.normal) < kTilted &&
         std::abs(turn) < kTurned && ratio < kFarther;
}

std::vector<Tie> ties_of(const BoardSighting& sighting, const Board& board) {
  std::vector<Tie> ties;
  for (const SeenPoint& point : sighting.points) ties.push_back({board.point(point.id).head<2>(), point.pixel});
  return ties;
}

std::vector<Tie> ties_of(const PoseView& view) {
  std::vector<Tie> ties;
  for (const BoardPoint& corner : view.corners) ties.push_back({corner.board_mm, corner.camera_px});
  return ties;
}

}  // namespace slsd
