// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/cloud/part_of_cloud.hpp"

#include <unordered_map>

#include "core/cloud/cube_grid.hpp"

namespace slsd {
namespace {

// Finds the most certain point of each cube.
class CubesOfPoints {
 public:
  explicit CubesOfPoints(double side_mm) : grid_(side_mm) {}

  /// @param index  of the point
  /// @return the index of the point that gives way, which may be this one; nothing if the cube was empty
  std::optional<std::size_t> offer(const Eigen::Vector3d& point, float sigma_mm, std::size_t index) {
    const auto [found, empty] = best_.try_emplace(grid_.at(point), Best{sigma_mm, index});
    if (empty) return std::nullopt;
    if (!(sigma_mm < found->second.sigma_mm)) return index;
    const std::size_t before = found->second.index;
    found->second = {sigma_mm, index};
    return before;
  }

 private:
  struct Best {
    float sigma_mm;
    std::size_t index;
  };
  CubeGrid grid_;
  std::unordered_map<Cube, Best, CubeHash> best_;
};

Eigen::Vector3d place_of(const DenseView& view, int x, int y, float depth_mm) {
  const Eigen::Vector2d ray = view.rays->at(x, y).cast<double>();
  return view.rig_from_camera * (static_cast<double>(depth_mm) * Eigen::Vector3d(ray.x(), ray.y(), 1));
}

// Visits the measured pixels: visit(index, x, y).
template <class Visit>
void for_each_measured(const DenseMap& map, const Visit& visit) {
  for (int y = map.part.top; y < map.part.bottom; ++y) {
    for (int x = map.part.left; x < map.part.right; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      if (map.measured(pixel)) visit(pixel, x, y);
    }
  }
}

}  // namespace

void keep_part(std::vector<CloudPoint>& points, const CloudPart& part) {
  const auto place = [](const CloudPoint& point) -> Eigen::Vector3d {
    return Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
  };
  if (part.box) std::erase_if(points, [&](const CloudPoint& point) { return !part.box->contains(place(point)); });
  if (part.side) std::erase_if(points, [&](const CloudPoint& point) { return !part.side->contains(place(point)); });
  if (part.voxel_mm <= 0) return;
  CubesOfPoints cubes(part.voxel_mm);
  std::vector<char> dropped(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const auto other = cubes.offer(place(points[i]), points[i].sigma_mm, i)) dropped[*other] = 1;
  std::size_t at = 0;
  std::erase_if(points, [&](const CloudPoint&) { return dropped[at++] != 0; });
}

void keep_part(std::span<DenseView> views, const CloudPart& part) {
  const bool needs_place = part.box || part.side || part.voxel_mm > 0;
  if (!needs_place && part.stride <= 1) return;
  CubesOfPoints cubes(part.voxel_mm);
  std::size_t first = 0;  // index of the view's first pixel among those of all views
  for (DenseView& view : views) {
    for_each_measured(view.map, [&](std::size_t pixel, int x, int y) {
      if (x % part.stride != 0 || y % part.stride != 0) return view.map.drop(pixel, DensePixel::kThinned);
      if (!needs_place) return;
      const Eigen::Vector3d place = place_of(view, x, y, view.map.depth_mm[pixel]);
      if (part.box && !part.box->contains(place)) return view.map.drop(pixel, DensePixel::kOutsideBox);
      if (part.side && !part.side->contains(place)) return view.map.drop(pixel, DensePixel::kBehindPlane);
      if (part.voxel_mm <= 0) return;
      auto other = cubes.offer(place, view.map.sigma_mm[pixel], first + pixel);
      if (!other) return;
      for (DenseView& each : views) {
        if (*other < each.map.pixels.size()) return each.map.drop(*other, DensePixel::kThinned);
        *other -= each.map.pixels.size();
      }
    });
    first += view.map.pixels.size();
  }
  for (DenseView& view : views) view.map.count_pixels();
}

}  // namespace slsd
