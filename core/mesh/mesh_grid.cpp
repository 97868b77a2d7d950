// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/mesh/mesh_grid.hpp"

#include <algorithm>
#include <limits>

namespace slsd {
namespace {

using Triangle = std::array<std::uint32_t, 3>;  // of pixels

/// Number of sigmas that must lie within a jump.
constexpr float kSigmas = 3;

class Joiner {
 public:
  Joiner(const PointGrid& grid, float jump) : grid_(grid), limits_mm_(grid.points_mm.size()) {
    for (std::size_t i = 0; i < limits_mm_.size(); ++i) {
      const float limit = jump * grid.points_mm[i].norm();
      limits_mm_[i] = kSigmas * grid.sigma_mm[i] < limit ? limit : kNone;
    }
  }
  /// The triangles between four pixels: a, b beside it, c below it, and d.
  void join(int x, int y, std::vector<Triangle>& triangles) const {
    const auto a = pixel(x, y), b = pixel(x + 1, y), c = pixel(x, y + 1), d = pixel(x + 1, y + 1);
    const bool ab = joined(a, b), ac = joined(a, c), bd = joined(b, d), cd = joined(c, d);
    const bool bc = joined(b, c), ad = joined(a, d);
    const int by_bc = bc ? (ab && ac) + (bd && cd) : 0, by_ad = ad ? (ab && bd) + (ac && cd) : 0;
    if (by_bc > by_ad || (by_bc == by_ad && distance(b, c) <= distance(a, d))) {
      if (bc && ab && ac) triangles.push_back({a, c, b});
      if (bc && bd && cd) triangles.push_back({b, c, d});
    } else {
      if (ad && ac && cd) triangles.push_back({a, c, d});
      if (ad && ab && bd) triangles.push_back({a, d, b});
    }
  }

 private:
  static constexpr float kNone = -1;
  [[nodiscard]] std::uint32_t pixel(int x, int y) const { return static_cast<std::uint32_t>(grid_.index(x, y)); }
  [[nodiscard]] float distance(std::uint32_t a, std::uint32_t b) const {
    return (grid_.points_mm[a] - grid_.points_mm[b]).norm();
  }
  [[nodiscard]] bool joined(std::uint32_t a, std::uint32_t b) const {
    return grid_.camera[a] == grid_.camera[b] && distance(a, b) <= std::min(limits_mm_[a], limits_mm_[b]);
  }

  const PointGrid& grid_;
  std::vector<float> limits_mm_;  // the longest edge at each pixel; kNone: no point to use
};

/// Copies the pixels that triangles use, and gives triangles their numbers.
Mesh take_used(const PointGrid& grid, std::vector<Triangle> triangles) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> vertex(grid.points_mm.size(), kUnused);
  for (const Triangle& triangle : triangles)
    for (const std::uint32_t pixel : triangle) vertex[pixel] = 0;
  Mesh mesh;
  for (std::size_t pixel = 0; pixel < vertex.size(); ++pixel) {
    if (vertex[pixel] == kUnused) continue;
    vertex[pixel] = static_cast<std::uint32_t>(mesh.vertices_mm.size());
    mesh.vertices_mm.push_back(grid.points_mm[pixel]);
    mesh.sigma_mm.push_back(grid.sigma_mm[pixel]);
    mesh.intensity.push_back(grid.intensity[pixel]);
    if (!grid.colours.empty()) mesh.colours.push_back(grid.colours[pixel]);
  }
  for (Triangle& triangle : triangles)
    for (std::uint32_t& corner : triangle) corner = vertex[corner];
  mesh.triangles = std::move(triangles);
  return mesh;
}

}  // namespace

Mesh mesh_grid(const PointGrid& grid, float jump) {
  const Joiner joiner(grid, jump);
  std::vector<Triangle> triangles;
  for (int y = 0; y + 1 < grid.height; ++y)
    for (int x = 0; x + 1 < grid.width; ++x) joiner.join(x, y, triangles);
  return take_used(grid, std::move(triangles));
}

}  // namespace slsd
