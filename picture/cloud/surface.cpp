// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/surface.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <Eigen/Geometry>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

// An edge longer than this many typical ones spans a gap in depth.
constexpr double kMaxEdge = 3.0;

using Corners = std::array<std::int32_t, 4>;  // clockwise from the top left; -1: no point

// The points by their cells. Its size is the number of points, wherever a file places them in the lattice.
class Lattice {
 public:
  explicit Lattice(const Cloud& cloud) {
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      const CloudPoint& point = cloud.points[i];
      cells_.emplace_back(key(point.camera, point.row, point.column), static_cast<std::int32_t>(i));
      for (const int row : {point.row - 1, int{point.row}})
        for (const int column : {point.column - 1, int{point.column}})
          if (row >= 0 && column >= 0) quads_.push_back(key(point.camera, row, column));
    }
    std::ranges::sort(cells_);
    std::ranges::sort(quads_);
    quads_.erase(std::unique(quads_.begin(), quads_.end()), quads_.end());  // clang 14 cannot read its ranges form
  }

  // Visits each square of four neighbouring cells that contains a point, by camera and row.
  template <class Visit>
  void for_each_quad(Visit visit) const {
    constexpr std::uint64_t kRow = 1U << 17U;
    for (const std::uint64_t quad : quads_)
      visit(Corners{at(quad), at(quad + 1), at(quad + kRow + 1), at(quad + kRow)});
  }

 private:
  // Cells have 16 bits; the one after the last must not wrap to another row.
  static std::uint64_t key(int camera, int row, int column) {
    return (static_cast<std::uint64_t>(camera) << 34U) + (static_cast<std::uint64_t>(row) << 17U) +
           static_cast<std::uint64_t>(column);
  }
  // If points share a cell, the last one counts.
  [[nodiscard]] std::int32_t at(std::uint64_t key) const {
    const auto after = std::ranges::upper_bound(cells_, key, {}, &std::pair<std::uint64_t, std::int32_t>::first);
    return after != cells_.begin() && std::prev(after)->first == key ? std::prev(after)->second : -1;
  }

  std::vector<std::pair<std::uint64_t, std::int32_t>> cells_;
  std::vector<std::uint64_t> quads_;
};

// The length of an edge in lattice pitches at its depth; a pitch grows with the distance.
double edge(const std::vector<Eigen::Vector3d>& points, std::int32_t a, std::int32_t b) {
  return (points[a] - points[b]).norm() / std::max(1.0, 0.5 * (points[a].z() + points[b].z()));
}

double typical_edge(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice) {
  std::vector<double> edges;
  lattice.for_each_quad([&](const Corners& quad) {
    if (quad[0] >= 0 && quad[1] >= 0) edges.push_back(edge(points, quad[0], quad[1]));
    if (quad[0] >= 0 && quad[3] >= 0) edges.push_back(edge(points, quad[0], quad[3]));
  });
  return median_in_place(edges);
}

class Joiner {
 public:
  Joiner(Surface& surface, double longest) : surface_(surface), longest_(longest) {}

  // Two triangles across the shorter diagonal, or one triangle for three corners.
  void join(const Corners& quad) {
    const bool falling = quad[0] >= 0 && quad[2] >= 0;
    const bool rising = quad[1] >= 0 && quad[3] >= 0;
    const bool along_falling =
        falling && (!rising || edge(surface_.points, quad[0], quad[2]) <= edge(surface_.points, quad[1], quad[3]));
    if (along_falling) {
      add(quad[0], quad[1], quad[2]);
      add(quad[0], quad[2], quad[3]);
    } else if (rising) {
      add(quad[0], quad[1], quad[3]);
      add(quad[1], quad[2], quad[3]);
    }
  }

 private:
  void add(std::int32_t a, std::int32_t b, std::int32_t c) {
    if (a < 0 || b < 0 || c < 0) return;
    const auto& points = surface_.points;
    if (std::max({edge(points, a, b), edge(points, b, c), edge(points, c, a)}) > longest_) return;
    const Eigen::Vector3d normal = (points[c] - points[a]).cross(points[b] - points[a]);
    for (const std::int32_t corner : {a, b, c}) surface_.normals[corner] += normal;
    surface_.triangles.push_back(
        {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)});
  }
  Surface& surface_;
  double longest_;
};

}  // namespace

Surface join_surface(const Cloud& cloud) {
  Surface surface;
  for (const CloudPoint& point : cloud.points) surface.points.emplace_back(point.x, point.y, point.z);
  surface.normals.assign(surface.points.size(), Eigen::Vector3d::Zero());
  const Lattice lattice(cloud);
  Joiner joiner(surface, kMaxEdge * typical_edge(surface.points, lattice));
  lattice.for_each_quad([&](const Corners& quad) { joiner.join(quad); });
  for (Eigen::Vector3d& normal : surface.normals) {
    if (normal.norm() > 0) normal.normalize();
  }
  return surface;
}

}  // namespace slsd
