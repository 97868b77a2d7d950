// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/foreign_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace slsd::model {
namespace {

/// Two surfaces are apart if they are so many pixels and sigmas apart.
constexpr float kApartPx = 2, kApartSigmas = 4;
/// Cosine between normal and ray from which on a witness should measure a surface.
constexpr float kFacing = 0.5F;
/// Least cosine of a surface that a witness may see.
constexpr float kSeen = 0.1F;
/// A place is empty if so many shots look through it, and so many for each that agrees.
constexpr unsigned kFewestThrough = 2;
constexpr float kThroughShare = 0.25F, kAgainstShare = 0.4F;
/// A smaller group of empty places is noise at an edge.
constexpr std::size_t kSmallestGroup = 8;
/// A cell is confirmed by so many shots that do not show the same foreign body.
constexpr unsigned kConfirmed = 2;

enum class Word { kNothing, kSilent, kThrough, kAlike, kAgrees };  // a later one outdoes an earlier one

/// A view that looks at places of other shots.
class Witness {
 public:
  Witness(const SurfaceView& view, const RigidTransform& witness_from_rig)
      : image_(view.image),
        grid_(view.levels.back()),
        rotation_(witness_from_rig.rotation.cast<float>()),
        translation_(witness_from_rig.translation.cast<float>()),
        camera_rotation_(view.image.camera_from_rig.rotation.cast<float>()),
        camera_translation_(view.image.camera_from_rig.translation.cast<float>()),
        eye_(-camera_rotation_.transpose() * camera_translation_) {}

  [[nodiscard]] Word on(const SurfaceCell& cell) const {
    const Eigen::Vector3f place = rotation_ * cell.place_mm + translation_;
    const Eigen::Vector3f in_camera = camera_rotation_ * place + camera_translation_;
    if (!(in_camera.z() > 0)) return Word::kNothing;
    const Eigen::Vector2f pixel = image_.pixel_of(in_camera).array() + 0.5F;
    const int column = static_cast<int>(std::floor(pixel.x() / static_cast<float>(grid_.step)));
    const int row = static_cast<int>(std::floor(pixel.y() / static_cast<float>(grid_.step)));
    if (!in_camera_image(column, row)) return Word::kNothing;
    const Eigen::Vector3f ray = (place - eye_).normalized();
    const float facing = -ray.dot(rotation_ * cell.normal);
    const float apart_mm = kApartPx * in_camera.z() / static_cast<float>(image_.lens.fx) + kApartSigmas * cell.sigma_mm;
    int measured = 0, farther = 0;
    bool agrees = false, alike = false;
    for (int y = row - 1; y <= row + 1; ++y) {
      for (int x = column - 1; x <= column + 1; ++x) {
        if (x < 0 || y < 0 || x >= grid_.width || y >= grid_.height) continue;
        const SurfaceCell& other = grid_.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width) +
                                               static_cast<std::size_t>(x)];
        if (!(other.sigma_mm > 0)) continue;
        ++measured;
        const Eigen::Vector3f there = other.place_mm - place;
        const float behind_mm = there.dot(ray);
        if (behind_mm > apart_mm) ++farther;
        if (std::abs(there.dot(other.normal)) < apart_mm) (other.foreign ? alike : agrees) = true;
      }
    }
    // All around it, too: a thin thing between two cells is measured in none.
    if (measured >= kFewestAround && farther == measured) return Word::kThrough;
    if (facing < kSeen) return Word::kNothing;
    if (measured == 0) return facing >= kFacing ? Word::kSilent : Word::kNothing;
    if (agrees) return Word::kAgrees;
    return alike ? Word::kAlike : Word::kNothing;
  }

 private:
  static constexpr int kFewestAround = 7;  // of nine

  /// Tells whether the camera sees the cell and those around it, measured or not.
  [[nodiscard]] bool in_camera_image(int column, int row) const {
    const int left = image_.left + (column - 1) * grid_.step, top = image_.top + (row - 1) * grid_.step;
    return left >= 0 && top >= 0 && left + 3 * grid_.step <= image_.lens.width_px &&
           top + 3 * grid_.step <= image_.lens.height_px;
  }

  const RangeImage& image_;
  const CellGrid& grid_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  Eigen::Matrix3f camera_rotation_;
  Eigen::Vector3f camera_translation_;
  Eigen::Vector3f eye_;
};

void add_one(std::uint8_t& number) {
  if (number < std::numeric_limits<std::uint8_t>::max()) ++number;
}

bool outweighs(unsigned against, float share, const CellEvidence& evidence) {
  return against >= kFewestThrough &&
         static_cast<float>(against) >= share * static_cast<float>(evidence.agree + evidence.alike);
}

bool is_empty(const CellEvidence& evidence) {
  return outweighs(evidence.through, kThroughShare, evidence);
}

bool is_doubtful(const CellEvidence& evidence) {
  return outweighs(evidence.through + evidence.silent, kAgainstShare, evidence);
}

/// The connected groups of doubtful cells that have enough empty ones among them.
std::vector<bool> foreign_of(const CellGrid& grid, const std::vector<CellEvidence>& evidence) {
  std::vector<bool> foreign(grid.cells.size()), visited(grid.cells.size());
  for (std::size_t first = 0; first < grid.cells.size(); ++first) {
    if (visited[first] || !is_empty(evidence[first])) continue;
    std::vector<std::size_t> group{first};
    visited[first] = true;
    std::size_t empty = 0;
    for (std::size_t next = 0; next < group.size(); ++next) {
      if (is_empty(evidence[group[next]])) ++empty;
      visit_cells_around(grid, group[next], 1, [&](std::size_t beside) {
        if (visited[beside] || !(grid.cells[beside].sigma_mm > 0)) return;
        if (!is_empty(evidence[beside]) && !is_doubtful(evidence[beside])) return;
        visited[beside] = true;
        group.push_back(beside);
      });
    }
    if (empty < kSmallestGroup) continue;
    for (const std::size_t cell : group) foreign[cell] = true;
  }
  return foreign;
}

void mark_coarse(CellGrid& coarse, const CellGrid& fine) {
  const int per = coarse.step / fine.step;
  for (int row = 0; row < coarse.height; ++row) {
    for (int column = 0; column < coarse.width; ++column) {
      int measured = 0, marked = 0;
      for (int y = row * per; y < std::min(fine.height, (row + 1) * per); ++y) {
        for (int x = column * per; x < std::min(fine.width, (column + 1) * per); ++x) {
          const SurfaceCell& cell = fine.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width) +
                                               static_cast<std::size_t>(x)];
          measured += cell.sigma_mm > 0 ? 1 : 0, marked += cell.foreign ? 1 : 0;
        }
      }
      coarse
          .cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(coarse.width) +
                 static_cast<std::size_t>(column)]
          .foreign = marked > 0 && 2 * marked >= measured;
    }
  }
}

}  // namespace

ShotEvidence no_evidence(const Shot& shot) {
  ShotEvidence evidence;
  for (const SurfaceView& view : shot.views) evidence.emplace_back(view.levels.back().cells.size());
  return evidence;
}

void weigh(ShotEvidence& evidence, const PlacedShot& shot, const PlacedShot& witness) {
  const RigidTransform witness_from_rig = witness.object_from_rig.inverse().after(shot.object_from_rig);
  std::vector<Witness> views;
  for (const SurfaceView& view : witness.shot->views) views.emplace_back(view, witness_from_rig);
  for (std::size_t i = 0; i < shot.shot->views.size(); ++i) {
    const std::vector<SurfaceCell>& cells = shot.shot->views[i].levels.back().cells;
    for (std::size_t j = 0; j < cells.size(); ++j) {
      if (!(cells[j].sigma_mm > 0)) continue;
      Word word = Word::kNothing;
      for (const Witness& view : views) word = std::max(word, view.on(cells[j]));
      if (word == Word::kAgrees) add_one(evidence[i][j].agree);
      if (word == Word::kAlike) add_one(evidence[i][j].alike);
      if (word == Word::kThrough) add_one(evidence[i][j].through);
      if (word == Word::kSilent) add_one(evidence[i][j].silent);
    }
  }
}

MissingShares missing_shares(const PlacedShot& shot, const PlacedShot& witness) {
  ShotEvidence evidence = no_evidence(*shot.shot);
  weigh(evidence, shot, witness);
  std::size_t all = 0, through = 0, silent = 0;
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    const std::vector<SurfaceCell>& cells = shot.shot->views[i].levels.back().cells;
    for (std::size_t j = 0; j < cells.size(); ++j) {
      if (!(cells[j].sigma_mm > 0) || cells[j].foreign) continue;
      ++all, through += evidence[i][j].through, silent += evidence[i][j].silent;
    }
  }
  const double cells = static_cast<double>(std::max<std::size_t>(1, all));
  return {static_cast<double>(through) / cells, static_cast<double>(silent) / cells};
}

void mark_coarse_cells(Shot& shot) {
  for (SurfaceView& view : shot.views)
    for (std::size_t level = 0; level + 1 < view.levels.size(); ++level)
      mark_coarse(view.levels[level], view.levels.back());
}

std::size_t mark_foreign(Shot& shot, const ShotEvidence& evidence) {
  std::size_t marked = 0;
  for (std::size_t i = 0; i < shot.views.size(); ++i) {
    SurfaceView& view = shot.views[i];
    CellGrid& fine = view.levels.back();
    const std::vector<bool> foreign = foreign_of(fine, evidence[i]);
    for (std::size_t j = 0; j < foreign.size(); ++j) fine.cells[j].foreign = foreign[j], marked += foreign[j] ? 1 : 0;
  }
  mark_coarse_cells(shot);
  return marked;
}

std::vector<std::vector<std::size_t>> grown_foreign(const PlacedShot& shot, std::span<const PlacedShot> witnesses) {
  Shot marked = *shot.shot;  // with the marked cells alone
  for (SurfaceView& view : marked.views)
    for (SurfaceCell& cell : view.levels.back().cells)
      if (!cell.foreign) cell.sigma_mm = 0;
  ShotEvidence evidence = no_evidence(*shot.shot);
  for (const PlacedShot& witness : witnesses) {
    ShotEvidence of_marked = no_evidence(marked);
    weigh(of_marked, {&marked, shot.object_from_rig}, witness);
    std::size_t same = 0, against = 0;
    for (const auto& cells : of_marked)
      for (const CellEvidence& cell : cells)
        same += static_cast<std::size_t>(cell.agree + cell.alike), against += cell.through + cell.silent;
    if (same <= against) weigh(evidence, shot, witness);
  }
  constexpr int kNear = 2;  // cells at an edge are not measured
  std::vector<std::vector<std::size_t>> grown;
  for (std::size_t i = 0; i < marked.views.size(); ++i) {
    const CellGrid& grid = shot.shot->views[i].levels.back();
    std::vector<std::size_t>& group = grown.emplace_back();
    std::vector<bool> visited(grid.cells.size());
    for (std::size_t cell = 0; cell < grid.cells.size(); ++cell)
      if (grid.cells[cell].foreign) group.push_back(cell), visited[cell] = true;
    for (std::size_t next = 0; next < group.size(); ++next) {
      visit_cells_around(grid, group[next], kNear, [&](std::size_t beside) {
        if (visited[beside] || !(grid.cells[beside].sigma_mm > 0) || evidence[i][beside].agree >= kConfirmed) return;
        visited[beside] = true;
        group.push_back(beside);
      });
    }
  }
  return grown;
}

void drop_foreign(std::vector<RangeImage>& images, const Shot& shot) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    RangeImage& image = images[i];
    const CellGrid& grid = shot.views[i].levels.back();
    std::vector<bool> dropped(grid.cells.size());
    for (std::size_t cell = 0; cell < grid.cells.size(); ++cell) {
      if (!grid.cells[cell].foreign) continue;
      dropped[cell] = true;
      // Cells without a plane at the edge of what is dropped belong to it.
      visit_cells_around(grid, cell, 1, [&](std::size_t beside) {
        if (!(grid.cells[beside].sigma_mm > 0)) dropped[beside] = true;
      });
    }
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if (dropped[static_cast<std::size_t>(y / grid.step) * static_cast<std::size_t>(grid.width) +
                    static_cast<std::size_t>(x / grid.step)])
          image.depth_mm[image.index(x, y)] = std::numeric_limits<float>::quiet_NaN();
  }
}

}  // namespace slsd::model
