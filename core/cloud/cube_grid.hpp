// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

namespace slsd {

/// Numbers of a cube in a grid of cubes.
struct Cube {
  std::int64_t x, y, z;
  friend bool operator==(const Cube&, const Cube&) = default;
};

struct CubeHash {
  std::size_t operator()(const Cube& cube) const {
    const auto mix = [](std::uint64_t value) { return (value ^ (value >> 29U)) * 0x9e3779b97f4a7c15U; };
    return mix(static_cast<std::uint64_t>(cube.x) +
               mix(static_cast<std::uint64_t>(cube.y) + mix(static_cast<std::uint64_t>(cube.z))));
  }
};

/// Divides space into cubes, one corner at the origin.
class CubeGrid {
 public:
  /// @param side_mm  of a cube; tiny ones count as kSmallestSideMm
  explicit CubeGrid(double side_mm) : side_mm_(std::max(side_mm, kSmallestSideMm)) {}

  [[nodiscard]] Cube at(const Eigen::Vector3d& point_mm) const {
    const Eigen::Vector3d cube = (point_mm / side_mm_).array().floor();
    return {static_cast<std::int64_t>(cube.x()), static_cast<std::int64_t>(cube.y()),
            static_cast<std::int64_t>(cube.z())};
  }

 private:
  static constexpr double kSmallestSideMm = 1e-6;  // holds one point, as floats are coarser; numbers fit into 64 bits
  double side_mm_;
};

}  // namespace slsd
