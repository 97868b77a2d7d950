// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/ball_bar.hpp"

#include <cmath>
#include <numbers>

namespace slsd {
namespace {

constexpr std::uint32_t kAround = 96, kRings = 48;
constexpr double kBarShare = 0.35;  // of the spheres' diameter

// A closed surface around the x axis, of rings between two ends. @param ring  radius at a share of the way, and x
template <class Ring>
void add_turned(Mesh& mesh, std::uint32_t rings, const Ring& ring) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_mm.size());
  const auto add = [&](double x, double radius, double turn) {
    mesh.vertices_mm.push_back(Eigen::Vector3d(x, radius * std::cos(turn), radius * std::sin(turn)).cast<float>());
  };
  for (std::uint32_t i = 0; i < rings; ++i) {
    const Eigen::Vector2d at = ring(i);
    for (std::uint32_t k = 0; k < kAround; ++k) add(at.x(), at.y(), 2 * std::numbers::pi * k / kAround);
  }
  const std::uint32_t low = first + rings * kAround, high = low + 1;
  add(ring(0).x(), 0, 0), add(ring(rings - 1).x(), 0, 0);
  const auto vertex = [&](std::uint32_t i, std::uint32_t k) { return first + i * kAround + k % kAround; };
  for (std::uint32_t k = 0; k < kAround; ++k) {
    mesh.triangles.push_back({low, vertex(0, k + 1), vertex(0, k)});
    mesh.triangles.push_back({high, vertex(rings - 1, k), vertex(rings - 1, k + 1)});
    for (std::uint32_t i = 0; i + 1 < rings; ++i) {
      mesh.triangles.push_back({vertex(i, k), vertex(i, k + 1), vertex(i + 1, k)});
      mesh.triangles.push_back({vertex(i + 1, k), vertex(i, k + 1), vertex(i + 1, k + 1)});
    }
  }
}

}  // namespace

Mesh ball_bar(double diameter_mm, double spacing_mm) {
  Mesh mesh;
  const double radius = diameter_mm / 2;
  for (const double middle : {-spacing_mm / 2, spacing_mm / 2}) {
    add_turned(mesh, kRings - 1, [&](std::uint32_t i) {
      const double turn = std::numbers::pi * (i + 1) / kRings;
      return Eigen::Vector2d(middle - radius * std::cos(turn), radius * std::sin(turn));
    });
  }
  add_turned(mesh, 2,
             [&](std::uint32_t i) { return Eigen::Vector2d((i == 0 ? -1 : 1) * spacing_mm / 2, kBarShare * radius); });
  return mesh;
}

}  // namespace slsd
