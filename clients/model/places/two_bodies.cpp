// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/two_bodies.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "clients/model/places/foreign_cells.hpp"
#include "clients/model/places/visit_pairs.hpp"
#include "core/geometry/robust.hpp"

namespace slsd::model {
namespace {

constexpr float kExplainedGateMm = 3, kExplainedSigmas = 4;
/// Share of all paired cells that a second body has at least. Errors of a cloud that agree have fewer.
constexpr double kSecondShare = 0.15;
/// A shot that one place explains to this share has no second body.
constexpr double kOneBody = 0.85;
/// Bodies whose places differ by less, in pixels, are one with an error.
constexpr double kSameBodyPx = 4;
/// A piece of the surface is looked for by itself if it has this part of the cells.
constexpr std::size_t kPieceShare = 8;
/// Places are looked for until so many.
constexpr int kPlaces = 3;

/// Marks the cells of a shot that a place explains. @return how many
std::size_t explain(Shot& shot, const RigidTransform& before_from_rig, const Shot& before) {
  std::vector<const SurfaceCell*> explained;
  visit_pairs(shot, before_from_rig, before, kCellSteps.size() - 1, kExplainedGateMm,
              [&](const SurfaceCell& cell, const SurfaceCell* other, const Eigen::Vector3f& place) {
                if (other && std::abs(other->normal.dot(place - other->place_mm)) <
                                 kExplainedSigmas * std::hypot(cell.sigma_mm, other->sigma_mm))
                  explained.push_back(&cell);
              });
  std::ranges::sort(explained);
  std::size_t count = 0;
  for (SurfaceView& view : shot.views)
    for (SurfaceCell& cell : view.levels.back().cells)
      if (std::ranges::binary_search(explained, &cell)) cell.foreign = true, ++count;
  mark_coarse_cells(shot);
  return count;
}

/// Usual distance between where two places put the shot's cells, in pixels.
double apart_px(const Shot& shot, const RigidTransform& a, const RigidTransform& b) {
  std::vector<double> apart;
  for (const SurfaceView& view : shot.views)
    for (const SurfaceCell& cell : view.levels.front().cells) {
      if (!(cell.sigma_mm > 0) || cell.foreign) continue;
      const Eigen::Vector3d place = cell.place_mm.cast<double>();
      const double depth_mm = (view.image.camera_from_rig * place).z();
      apart.push_back((a * place - b * place).norm() * view.image.lens.fx / depth_mm);
    }
  return median_of(apart);
}

std::size_t open_cells(const Shot& shot) {
  std::size_t count = 0;
  for (const SurfaceView& view : shot.views)
    for (const SurfaceCell& cell : view.levels.back().cells) count += cell.sigma_mm > 0 && !cell.foreign ? 1 : 0;
  return count;
}

/// The open cells that hang together in the picture and in depth, if they are so many; all others are marked.
std::vector<Shot> pieces_of(const Shot& shot, std::size_t fewest) {
  constexpr float kJumpCells = 4;
  std::vector<Shot> pieces;
  for (std::size_t i = 0; i < shot.views.size(); ++i) {
    const CellGrid& grid = shot.views[i].levels.back();
    const RangeImage& image = shot.views[i].image;
    const auto index = [&](int x, int y) {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x);
    };
    const auto is_open = [&](const SurfaceCell& cell) { return cell.sigma_mm > 0 && !cell.foreign; };
    std::vector<bool> visited(grid.cells.size());
    for (std::size_t from = 0; from < grid.cells.size(); ++from) {
      if (visited[from] || !is_open(grid.cells[from])) continue;
      std::vector<std::size_t> piece{from};
      visited[from] = true;
      for (std::size_t next = 0; next < piece.size(); ++next) {
        const SurfaceCell& cell = grid.cells[piece[next]];
        const float jump_mm = kJumpCells * static_cast<float>(grid.step / image.lens.fx) *
                              static_cast<float>((image.camera_from_rig * cell.place_mm.cast<double>()).z());
        const int column = static_cast<int>(piece[next] % static_cast<std::size_t>(grid.width)),
                  row = static_cast<int>(piece[next] / static_cast<std::size_t>(grid.width));
        for (int y = std::max(0, row - 1); y <= std::min(grid.height - 1, row + 1); ++y)
          for (int x = std::max(0, column - 1); x <= std::min(grid.width - 1, column + 1); ++x) {
            const SurfaceCell& beside = grid.cells[index(x, y)];
            if (visited[index(x, y)] || !is_open(beside) || (beside.place_mm - cell.place_mm).norm() > jump_mm)
              continue;
            visited[index(x, y)] = true;
            piece.push_back(index(x, y));
          }
      }
      if (piece.size() < fewest) continue;
      Shot alone = shot;
      for (SurfaceView& view : alone.views)
        for (SurfaceCell& cell : view.levels.back().cells) cell.foreign = true;
      for (const std::size_t cell : piece) alone.views[i].levels.back().cells[cell].foreign = false;
      mark_coarse_cells(alone);
      pieces.push_back(std::move(alone));
    }
  }
  return pieces;
}

/// The place that most cells of the rest agree with, or most of a piece of it.
std::optional<Alignment> best_place(const Shot& rest, const PlacedShot& before, std::span<const RigidTransform> starts,
                                    std::size_t fewest) {
  std::vector<Shot> shots = pieces_of(rest, fewest);
  shots.push_back(rest);
  std::optional<Alignment> best;
  for (const Shot& shot : shots) {
    for (const RigidTransform& start : starts) {
      for (const std::size_t first : {std::size_t{1}, std::size_t{0}}) {
        const auto found = align(shot, {&before, 1}, start, first);
        if (found && fits(*found) && (!best || found->pairs > best->pairs)) best = found;
      }
    }
  }
  return best;
}

}  // namespace

bool shows_two_bodies(const PlacedShot& placed, const PlacedShot& before, std::span<const RigidTransform> starts) {
  Shot rest = *placed.shot;
  const std::size_t all = open_cells(rest);
  const RigidTransform before_from_object = before.object_from_rig.inverse();
  RigidTransform place = placed.object_from_rig;
  std::size_t first = explain(rest, before_from_object.after(place), *before.shot);
  if (static_cast<double>(first) > kOneBody * static_cast<double>(all)) return false;
  // A place between those of two bodies explains little of either.
  for (int i = 0; i < kPlaces; ++i) {
    const auto other = best_place(rest, before, starts, all / kPieceShare);
    if (!other && i == 0 && 2 * first < all) {
      // Such a place may have taken so much of each body that neither is found in the rest.
      rest = *placed.shot;
      const auto body = best_place(rest, before, starts, all / kPieceShare);
      if (!body) return false;
      place = body->object_from_rig;
      first = explain(rest, before_from_object.after(place), *before.shot);
      continue;
    }
    if (!other) return false;
    const double off_px = apart_px(rest, place, other->object_from_rig);
    const std::size_t second = explain(rest, before_from_object.after(other->object_from_rig), *before.shot);
    const double fewest = kSecondShare * static_cast<double>(first + second);
    if (off_px > kSameBodyPx && static_cast<double>(std::min(first, second)) > fewest) return true;
    if (second > first) first = second, place = other->object_from_rig;
  }
  return false;
}

}  // namespace slsd::model
