// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/picture/surface.hpp"

#include <algorithm>

#include <Eigen/Geometry>

namespace slsd {
namespace {

// An edge longer than this many typical ones spans a gap in depth.
constexpr double kMaxEdge = 3.0;

// Index of the point in each cell of each camera's lattice, or -1; one ring of empty cells around it.
class Lattice {
 public:
  explicit Lattice(const Cloud& cloud) {
    for (const CloudPoint& point : cloud.points) {
      columns_ = std::max(columns_, point.column + 2);
      rows_ = std::max(rows_, point.row + 2);
      cameras_ = std::max(cameras_, point.camera + 1);
    }
    cells_.assign(static_cast<std::size_t>(columns_) * rows_ * cameras_, -1);
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      const CloudPoint& point = cloud.points[i];
      cells_[index(point.camera, point.row, point.column)] = static_cast<std::int32_t>(i);
    }
  }
  [[nodiscard]] std::int32_t at(int camera, int row, int column) const { return cells_[index(camera, row, column)]; }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int cameras() const { return cameras_; }

 private:
  [[nodiscard]] std::size_t index(int camera, int row, int column) const {
    return (static_cast<std::size_t>(camera) * rows_ + row) * columns_ + column;
  }
  int columns_ = 0, rows_ = 0, cameras_ = 0;
  std::vector<std::int32_t> cells_;
};

using Corners = std::array<std::int32_t, 4>;  // clockwise from the top left

template <class Visit>
void for_each_quad(const Lattice& lattice, Visit visit) {
  for (int camera = 0; camera < lattice.cameras(); ++camera) {
    for (int row = 0; row + 1 < lattice.rows(); ++row) {
      for (int column = 0; column + 1 < lattice.columns(); ++column) {
        visit(Corners{lattice.at(camera, row, column), lattice.at(camera, row, column + 1),
                      lattice.at(camera, row + 1, column + 1), lattice.at(camera, row + 1, column)});
      }
    }
  }
}

// Length of an edge in lattice pitches at its depth, where a pitch grows with the distance.
double edge(const std::vector<Eigen::Vector3d>& points, std::int32_t a, std::int32_t b) {
  return (points[a] - points[b]).norm() / std::max(1.0, 0.5 * (points[a].z() + points[b].z()));
}

double typical_edge(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice) {
  std::vector<double> edges;
  for_each_quad(lattice, [&](const Corners& quad) {
    if (quad[0] >= 0 && quad[1] >= 0) edges.push_back(edge(points, quad[0], quad[1]));
    if (quad[0] >= 0 && quad[3] >= 0) edges.push_back(edge(points, quad[0], quad[3]));
  });
  if (edges.empty()) return 0.0;
  std::nth_element(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2), edges.end());
  return edges[edges.size() / 2];
}

class Joiner {
 public:
  Joiner(Surface& surface, double longest) : surface_(surface), longest_(longest) {}

  // Two triangles across the shorter diagonal, or the one that three corners allow.
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
  for_each_quad(lattice, [&](const Corners& quad) { joiner.join(quad); });
  for (Eigen::Vector3d& normal : surface.normals) {
    if (normal.norm() > 0) normal.normalize();
  }
  return surface;
}

}  // namespace slsd
