// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/mesh/mesh.hpp"

#include <Eigen/Geometry>

namespace slsd {

std::vector<Eigen::Vector3f> normals_of(const Mesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices_mm.size(), Eigen::Vector3f::Zero());
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f& first = mesh.vertices_mm[triangle[0]];
    const Eigen::Vector3f cross = (mesh.vertices_mm[triangle[1]] - first).cross(mesh.vertices_mm[triangle[2]] - first);
    for (const std::uint32_t vertex : triangle) normals[vertex] += cross;
  }
  return normals;
}

}  // namespace slsd
