// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/measured_points.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "core/board/tie.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

template <class Measure>
double median_of(const std::vector<MeasuredPoint>& points, Measure&& measure) {
  std::vector<double> values;
  for (const auto& point : points) values.push_back(measure(point));
  return median_in_place(values);
}

std::vector<Tie> ties_of_points(const std::vector<MeasuredPoint>& points, const Board& board) {
  std::vector<Tie> ties;
  for (const auto& measured : points) ties.push_back({board.point(measured.point.id).head<2>(), measured.point.pixel});
  return ties;
}

double shorter_pitch(const std::vector<MeasuredPoint>& points, const Homography& homography, const Board& board) {
  return board.pitch_mm * median_of(points, [&](const auto& measured) {
           const auto jacobian = homography.jacobian(board.point(measured.point.id).template head<2>());
           return jacobian.colwise().norm().minCoeff();
         });
}

struct Clipped {
  double share = 0, full_share = 0;
};

// Reads each pixel once, for pixels inside the seen points, to about a pixel.
Clipped clipped_shares(const std::vector<MeasuredPoint>& points, const Homography& homography, const Board& board,
                       const BoardPhoto& photo, double pitch_px) {
  Eigen::AlignedBox2d area;
  for (const auto& measured : points) area.extend(board.point(measured.point.id).head<2>());
  const double step = board.pitch_mm / std::max(2.0, pitch_px);
  int looked = 0;
  int full = 0, dark = 0;
  for (double y = area.min().y(); y <= area.max().y(); y += step) {
    for (double x = area.min().x(); x <= area.max().x(); x += step) {
      const Eigen::Vector2d pixel = homography.map({x, y});
      const int column = static_cast<int>(std::lround(pixel.x()));
      const int row = static_cast<int>(std::lround(pixel.y()));
      if (!photo.light.view().contains(column, row)) continue;
      ++looked;
      full += photo.light.at(column, row) >= photo.full ? 1 : 0;
      dark += photo.light.at(column, row) <= 0 ? 1 : 0;
    }
  }
  if (looked == 0) return {};
  return {static_cast<double>(full + dark) / looked, static_cast<double>(full) / looked};
}

}  // namespace

BoardSighting summarise(std::vector<MeasuredPoint> points, const BoardPhoto& photo, const Board& board) {
  std::ranges::sort(points, {}, [](const auto& measured) { return measured.point.id; });
  BoardSighting sighting;
  for (const auto& measured : points) sighting.points.push_back(measured.point);
  sighting.contrast = median_of(points, [](const auto& measured) { return std::abs(measured.step); }) / photo.full;
  sighting.edge_px = median_of(points, [](const auto& measured) { return measured.blur_px; });
  if (const auto homography = fit_homography(ties_of_points(points, board))) {
    sighting.pitch_px = shorter_pitch(points, *homography, board);
    const Clipped clipped = clipped_shares(points, *homography, board, photo, sighting.pitch_px);
    sighting.clipped_share = clipped.share, sighting.full_share = clipped.full_share;
  }
  return sighting;
}

bool span_a_plane(const std::vector<MeasuredPoint>& points, const Board& board, std::size_t least) {
  Eigen::AlignedBox2d area;
  for (const auto& measured : points) area.extend(board.point(measured.point.id).head<2>());
  return points.size() >= least && area.sizes().minCoeff() > 0;
}

}  // namespace slsd
