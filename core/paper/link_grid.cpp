// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/paper/link_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "core/code/symbol.hpp"

namespace slsd {
namespace {

using Point = Eigen::Vector2d;
using std::numbers::pi;
constexpr double kCloseRange = 2.5;  // R_C, in grid distances

struct Neighbourhood {
  std::optional<double> direction_rad;
  std::optional<double> grid_px;
};

// Modulo pi: moments cannot distinguish the two directions, so take the upright one.
double direction_of(const Descriptors& shape, const PaperGrid::Letter& letter) {
  return std::remainder(shape.orientation_rad - letter.orientation_rad, pi);
}

// Equation (11).
double grid_distance(const Descriptors& shape, double spacing_to_size) {
  const double side_px = shape.equivalent_diameter_px / std::sqrt(shape.rectangularity);
  return side_px * (1 + spacing_to_size);
}

std::vector<Neighbourhood> own_neighbourhoods(std::span<const PaperRegion> regions, const PaperGrid& grid) {
  std::vector<Neighbourhood> own(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].letter < 0) continue;
    const PaperGrid::Letter& letter = grid.letters[static_cast<std::size_t>(regions[i].letter)];
    if (letter.carries_direction) own[i].direction_rad = direction_of(regions[i].shape, letter);
    if (letter.fills_cell) own[i].grid_px = grid_distance(regions[i].shape, grid.spacing_to_size);
  }
  return own;
}

// The value of the closest region within the range that has one (equation (10)).
template <class Member>
std::optional<double> from_closest(std::span<const PaperRegion> regions, const std::vector<Neighbourhood>& own,
                                   std::size_t region, Member member, double range_px) {
  std::optional<double> closest;
  double least = range_px * range_px;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const double distance = (regions[i].shape.centroid_px - regions[region].shape.centroid_px).squaredNorm();
    if (i == region || distance >= least || !(own[i].*member)) continue;
    least = distance;
    closest = own[i].*member;
  }
  return closest;
}

void complete(std::span<const PaperRegion> regions, const PaperGrid& grid, std::vector<Neighbourhood>& all) {
  const std::vector<Neighbourhood> own = all;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].letter < 0) continue;
    // A symbol that does not fill its cell is smaller, so its own grid distance would make the range too short.
    const double longest_px = 2 * grid_distance(regions[i].shape, grid.spacing_to_size);
    const double range_px = kCloseRange * own[i].grid_px.value_or(longest_px);
    if (!own[i].grid_px) all[i].grid_px = from_closest(regions, own, i, &Neighbourhood::grid_px, range_px);
    if (!own[i].direction_rad) {
      all[i].direction_rad = from_closest(regions, own, i, &Neighbourhood::direction_rad, range_px);
    }
  }
}

std::int32_t label_at(const Image<std::int32_t>& labels, const Point& place) {
  const Point nearest = (place.array() + 0.5).floor();
  const auto x = static_cast<int>(nearest.x()), y = static_cast<int>(nearest.y());
  return labels.view().contains(x, y) ? labels.at(x, y) : -1;
}

// Equations (19) to (22).
std::int32_t region_near(const Image<std::int32_t>& labels, const Point& expected, double grid_px, std::int32_t from) {
  const Point diagonal = Point(1, -1) * std::cos(pi / 4);
  for (int distance_px = 0; distance_px <= grid_px / 2; ++distance_px) {
    for (const double side : {1., -1.}) {
      const std::int32_t found = label_at(labels, expected + side * distance_px * diagonal);
      if (found >= 0 && found != from) return found;
    }
  }
  return -1;
}

class Linker {
 public:
  explicit Linker(std::span<const PaperRegion> regions) : regions_(regions), links_(regions.size(), {-1, -1, -1, -1}) {}

  // Links both ends unless the neighbour is already linked with a closer one.
  void link(std::int32_t from, std::int32_t to, Direction direction) {
    const Direction back = direction == kRight ? kLeft : kUp;
    std::int32_t& rival = at(to, back);
    if (rival >= 0) {
      if (distance(rival, to) <= distance(from, to)) return;
      at(rival, direction) = -1;
    }
    rival = from;
    at(from, direction) = to;
  }

  [[nodiscard]] std::vector<Links> take() { return std::move(links_); }

 private:
  std::int32_t& at(std::int32_t region, Direction direction) {
    return links_[static_cast<std::size_t>(region)][direction];
  }
  [[nodiscard]] const Point& centroid(std::int32_t region) const {
    return regions_[static_cast<std::size_t>(region)].shape.centroid_px;
  }
  [[nodiscard]] double distance(std::int32_t a, std::int32_t b) const { return (centroid(a) - centroid(b)).norm(); }

  std::span<const PaperRegion> regions_;
  std::vector<Links> links_;
};

}  // namespace

PaperGrid make_paper_grid(std::span<const int> symbols, int size_px, int spacing_px) {
  PaperGrid grid{{}, static_cast<double>(spacing_px) / size_px};
  for (const int number : symbols) {
    const Descriptors shape = describe_shape(draw_symbol(number, size_px));
    const double rectangle_px = shape.area_px / shape.rectangularity;
    const bool fills_cell = rectangle_px > 0.9 * size_px * size_px;
    grid.letters.push_back({symbol(number).carries_direction, shape.orientation_rad, fills_cell});
  }
  return grid;
}

std::vector<Links> link_grid_paper(std::span<const PaperRegion> regions, const Image<std::int32_t>& labels,
                                   const PaperGrid& grid) {
  std::vector<Neighbourhood> neighbourhoods = own_neighbourhoods(regions, grid);
  complete(regions, grid, neighbourhoods);
  Linker linker(regions);
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const auto& [direction_rad, grid_px] = neighbourhoods[i];
    if (!direction_rad || !grid_px) continue;
    const auto from = static_cast<std::int32_t>(i);
    const Point& here = regions[i].shape.centroid_px;
    const Point along_u(std::cos(*direction_rad), std::sin(*direction_rad));
    const Point along_v(-along_u.y(), along_u.x());
    const std::int32_t right = region_near(labels, here + *grid_px * along_u, *grid_px, from);
    const std::int32_t down = region_near(labels, here + *grid_px * along_v, *grid_px, from);
    if (right >= 0) linker.link(from, right, kRight);
    if (down >= 0) linker.link(from, down, kDown);
  }
  return linker.take();
}

}  // namespace slsd
