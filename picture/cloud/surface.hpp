// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/cloud.hpp"

namespace slsd {

/// A cloud joined to a surface: neighbours of the pattern's lattice are joined if their distance suits a smooth
/// surface.
struct Surface {
  std::vector<Eigen::Vector3d> points;   ///< mm, rig frame; the cloud's points, in its order
  std::vector<Eigen::Vector3d> normals;  ///< unit length, towards the first camera; zero if nothing is joined
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// @thread reentrant
[[nodiscard]] Surface join_surface(const Cloud& cloud);

}  // namespace slsd
