// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/board_region.hpp"

#include <cmath>
#include <vector>

#include "core/exposure/light_levels.hpp"

namespace slsd {
namespace {

/// Width of the border that is certainly white, of the board's pitch.
constexpr double kBorder = 0.8;
/// Reach of a symbol, of the board's pitch: one larger than a square of the board cannot be read among its edges.
constexpr double kNear = kBorder + 1;

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
      size_mm_(board.width_mm(), board.height_mm()),
      border_mm_(kBorder * board.pitch_mm),
      near_mm_(kNear * board.pitch_mm) {}

bool BoardRegion::is_within(double margin_mm, const Eigen::Vector2d& camera_px) const {
  const Eigen::Array2d place = board_from_camera_.map(camera_px);
  return (place >= -margin_mm).all() && (place <= size_mm_.array() + margin_mm).all();
}

bool BoardRegion::contains(const Eigen::Vector2d& camera_px) const {
  return is_within(border_mm_, camera_px);
}

bool BoardRegion::is_near(const Eigen::Vector2d& camera_px) const {
  return is_within(near_mm_, camera_px);
}

bool BoardRegion::is_printed(const Eigen::Vector2d& camera_px) const {
  return is_within(0, camera_px);
}

double full_share_of_print(const GreyView& image, const Board& board, const BoardSighting& sighting) {
  constexpr double kPixelsLookedAt = 5e5;  // more pixels add no information
  const BoardRegion region(board, sighting);
  const double full = guess_full_level(image);
  return std::visit(
      [&](const auto& view) {
        const int step =
            1 + static_cast<int>(std::sqrt(static_cast<double>(view.width) * view.height / kPixelsLookedAt));
        std::size_t all = 0, at_full = 0;
        for (int y = 0; y < view.height; y += step) {
          for (int x = 0; x < view.width; x += step) {
            if (!region.is_printed({x, y})) continue;
            ++all, at_full += view.at(x, y) >= full ? 1 : 0;
          }
        }
        return all == 0 ? 0 : static_cast<double>(at_full) / static_cast<double>(all);
      },
      image);
}

}  // namespace slsd
