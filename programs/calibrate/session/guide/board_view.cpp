// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/board_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace slsd {
namespace {

constexpr std::size_t kPointsMin = 4;

/// Empty if too few points are seen both times.
std::optional<double> moved_px(const BoardSighting& before, const BoardSighting& after) {
  double sum = 0;
  std::size_t count = 0;
  for (const SeenPoint& point : after.points) {
    const auto same = std::ranges::lower_bound(before.points, point.id, {}, &SeenPoint::id);
    if (same == before.points.end() || same->id != point.id) continue;
    sum += (point.pixel - same->pixel).squaredNorm();
    ++count;
  }
  if (count < kPointsMin) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

}  // namespace

BoardView look_for_board(std::vector<GreyImage> pictures, const Board& board) {
  BoardView seen{std::move(pictures), {}};
  for (const GreyImage& picture : seen.pictures) seen.sightings.push_back(find_board(view(picture), board));
  return seen;
}

bool is_seen(const BoardSightings& sightings) {
  return std::ranges::any_of(sightings, [](const auto& sighting) { return sighting.has_value(); });
}

double moved_px(const BoardSightings& before, const BoardSightings& after) {
  std::optional<double> most;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    if (!before[i] || !after[i]) continue;
    const auto moved = moved_px(*before[i], *after[i]);
    if (moved) most = std::max(most.value_or(0), *moved);
  }
  return most.value_or(std::numeric_limits<double>::infinity());
}

}  // namespace slsd
