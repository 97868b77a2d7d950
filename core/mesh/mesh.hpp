// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/colour.hpp"

namespace slsd {

/// A surface of triangles. Seen from outside, that is from where it was measured, corners run counter-clockwise.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices
  // For each vertex, or empty:
  std::vector<float> sigma_mm;          ///< one standard deviation
  std::vector<std::uint8_t> intensity;  ///< 0 to 255
  std::vector<Rgb> colours;             ///< of the surface; if empty, files show the intensity in its place
  std::vector<std::uint16_t> frames;    ///< how many frames measured it

  [[nodiscard]] bool shows_colour() const { return !colours.empty() || !intensity.empty(); }
  /// The colour that files show of a vertex.
  [[nodiscard]] Rgb shown_colour(std::size_t vertex) const {
    return colours.empty() ? grey_of(intensity[vertex]) : colours[vertex];
  }
};

/// The normal of each vertex towards the outside: the sum of those of its triangles, each as long as twice its area.
/// @thread reentrant
[[nodiscard]] std::vector<Eigen::Vector3f> normals_of(const Mesh& mesh);

}  // namespace slsd
