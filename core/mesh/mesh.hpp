// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace slsd {

/// A surface of triangles. Seen from outside, that is from where it was measured, corners run counter-clockwise.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices
  // For each vertex, or empty:
  std::vector<float> sigma_mm;          ///< one standard deviation
  std::vector<std::uint8_t> intensity;  ///< 0 to 255
  std::vector<std::uint16_t> frames;    ///< how many frames measured it
};

}  // namespace slsd
