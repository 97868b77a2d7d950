// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/mesh/tidy_mesh.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <unordered_map>
#include <vector>

namespace slsd::model {
namespace {

/// Union-find with paths halved.
class Groups {
 public:
  explicit Groups(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0U); }
  [[nodiscard]] std::uint32_t of(std::uint32_t item) {
    while (parents_[item] != item) item = parents_[item] = parents_[parents_[item]];
    return item;
  }
  void join(std::uint32_t a, std::uint32_t b) { parents_[of(a)] = of(b); }

 private:
  std::vector<std::uint32_t> parents_;
};

/// Groups the corners of triangles: corner i of triangle t is 3 t + i. Two corners at one vertex are of one fan if
/// their triangles share an edge there.
Groups fans_of(const Mesh& mesh) {
  Groups fans(3 * mesh.triangles.size());
  std::unordered_map<std::uint64_t, std::uint32_t> edges;  // from its first vertex to its second: the first's corner
  edges.reserve(3 * mesh.triangles.size());
  const auto key = [](std::uint32_t a, std::uint32_t b) { return std::uint64_t{a} << 32 | b; };
  const auto next = [](std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
  const auto vertex = [&](std::uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
  const auto corners = static_cast<std::uint32_t>(3 * mesh.triangles.size());
  for (std::uint32_t corner = 0; corner < corners; ++corner)
    edges.emplace(key(vertex(corner), vertex(next(corner))), corner);
  for (std::uint32_t corner = 0; corner < corners; ++corner) {
    const auto back = edges.find(key(vertex(next(corner)), vertex(corner)));
    if (back == edges.end()) continue;
    fans.join(corner, next(back->second));
    fans.join(next(corner), back->second);
  }
  return fans;
}

/// Tells of each triangle whether its piece is large enough.
std::vector<bool> large_pieces(const Mesh& mesh, Groups& fans, double smallest_share) {
  const std::size_t count = mesh.triangles.size();
  Groups pieces(3 * count);
  for (std::uint32_t t = 0; t < count; ++t)
    for (std::uint32_t i = 0; i < 3; ++i) {
      pieces.join(3 * t, 3 * t + i);
      pieces.join(3 * t + i, fans.of(3 * t + i));
    }
  std::vector<std::size_t> sizes(3 * count);
  for (std::uint32_t t = 0; t < count; ++t) ++sizes[pieces.of(3 * t)];
  std::vector<bool> large(count);
  for (std::uint32_t t = 0; t < count; ++t)
    large[t] = static_cast<double>(sizes[pieces.of(3 * t)]) >= smallest_share * static_cast<double>(count);
  return large;
}

}  // namespace

Mesh tidy(const Mesh& mesh, double smallest_share) {
  Groups fans = fans_of(mesh);
  const std::vector<bool> large = large_pieces(mesh, fans, smallest_share);
  Mesh tidied;
  std::unordered_map<std::uint32_t, std::uint32_t> vertices;  // by fan
  const auto copy = [](const auto& from, auto& to, std::uint32_t vertex) {
    if (!from.empty()) to.push_back(from[vertex]);
  };
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!large[t]) continue;
    auto& triangle = tidied.triangles.emplace_back();
    for (std::uint32_t i = 0; i < 3; ++i) {
      const auto [found, is_new] =
          vertices.emplace(fans.of(3 * t + i), static_cast<std::uint32_t>(tidied.vertices_mm.size()));
      triangle[i] = found->second;
      if (!is_new) continue;
      const std::uint32_t vertex = mesh.triangles[t][i];
      copy(mesh.vertices_mm, tidied.vertices_mm, vertex);
      copy(mesh.sigma_mm, tidied.sigma_mm, vertex);
      copy(mesh.intensity, tidied.intensity, vertex);
      copy(mesh.colours, tidied.colours, vertex);
      copy(mesh.frames, tidied.frames, vertex);
    }
  }
  return tidied;
}

}  // namespace slsd::model
