// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/find_plane.hpp"

#include <algorithm>
#include <string>

#include "core/board/markers/marker_edges.hpp"
#include "core/board/markers/markers_in_photo.hpp"
#include "core/board/measured_points.hpp"

namespace slsd {
namespace {

constexpr double kClearPx = 2;  // distance kept from the bits inside the border, which is one cell wide
constexpr double kLeastReachPx = 1.5;
constexpr double kGreatestReachPx = 5;

}  // namespace

Result<BoardSighting> find_plane(const BoardPhoto& photo, const Board& board) {
  const auto markers = markers_in_photo(photo, board);
  if (!markers) return tl::unexpected(markers.error());
  std::vector<MeasuredPoint> points;
  for (const SeenMarker& marker : *markers) {
    const double cell_px = marker.side_px() / board.family->cells();
    const double reach = std::clamp(cell_px - kClearPx, kLeastReachPx, kGreatestReachPx);
    const auto corners = measure_square(photo.light, marker.corners, reach);
    if (!corners) continue;
    for (MeasuredPoint point : *corners) {
      point.point.id += 4 * marker.id;
      points.push_back(point);
    }
  }
  if (points.empty()) {
    return fail(ErrorCode::kNotFound,
                "the markers of " + describe(board) + " are too blurred or too small to measure; focus, and add light");
  }
  return summarise(std::move(points), photo, board);
}

}  // namespace slsd
