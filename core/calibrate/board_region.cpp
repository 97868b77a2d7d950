// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/board_region.hpp"

#include <vector>

namespace slsd {
namespace {

/// Of the board's pitch: as much of the border as is white for certain.
constexpr double kBorder = 0.8;

Homography board_from_camera(const Board& board, const BoardSighting& sighting) {
  std::vector<Eigen::Vector2d> camera, plane;
  for (const SeenPoint& point : sighting.points) {
    camera.push_back(point.pixel);
    plane.emplace_back(board.point(point.id).head<2>());
  }
  return fit_robust_homography(camera, plane);
}

}  // namespace

BoardRegion::BoardRegion(const Board& board, const BoardSighting& sighting)
    : board_from_camera_(board_from_camera(board, sighting)),
      low_mm_(Eigen::Vector2d::Constant(-kBorder * board.pitch_mm)),
      high_mm_(Eigen::Vector2d(board.width_mm(), board.height_mm()) +
               Eigen::Vector2d::Constant(kBorder * board.pitch_mm)) {}

bool BoardRegion::contains(const Eigen::Vector2d& camera_px) const {
  const Eigen::Vector2d place = board_from_camera_.map(camera_px);
  return (place.array() >= low_mm_.array()).all() && (place.array() <= high_mm_.array()).all();
}

}  // namespace slsd
