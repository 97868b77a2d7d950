// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/progress/preview_points.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "core/colour.hpp"

namespace slsd::model {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are copied as they lie in memory");

constexpr int kAxisBits = 21;  // of a key
constexpr std::uint8_t kColourless = 128;

template <class Value>
void put_value(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Width that the cells of a shot have on the surface, at its middle.
float cell_width_mm(const Shot& shot) {
  const RangeImage& image = shot.views.front().image;
  const Eigen::Vector3d middle = image.camera_from_rig.rotation * shot.middle_mm() + image.camera_from_rig.translation;
  return static_cast<float>(kCellSteps.back() * middle.z() / image.lens.fx);
}

}  // namespace

PreviewPoints::Key PreviewPoints::key_of(const Eigen::Vector3f& place_mm) const {
  Key key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    constexpr float kMiddle = 1 << (kAxisBits - 1);
    const float cube = std::floor(place_mm[axis] / edge_mm_) + kMiddle;
    key = key << kAxisBits | static_cast<Key>(std::clamp(cube, 0.0F, 2 * kMiddle - 1));
  }
  return key;
}

PreviewPoints::Cube& PreviewPoints::add(const Eigen::Vector3f& place_mm, const Eigen::Vector3f& normal) {
  if (cubes_.size() >= most_ && !cubes_.contains(key_of(place_mm))) enlarge();
  Cube& cube = cubes_[key_of(place_mm)];
  cube.place_mm += place_mm;
  cube.normal += normal;
  ++cube.added;
  return cube;
}

void PreviewPoints::add_colour(Cube& cube, const Rgb& colour) {
  cube.colour += Eigen::Vector3f(colour[0], colour[1], colour[2]);
  ++cube.with_colour;
  has_colour_ = true;
}

/// Doubles the edges until half of the room is free.
void PreviewPoints::enlarge() {
  while (cubes_.size() > most_ / 2) {
    edge_mm_ *= 2;
    const auto smaller = std::exchange(cubes_, {});
    for (const auto& [key, old] : smaller) {
      Cube& cube = cubes_[key_of(old.place_mm / old.added)];
      cube.place_mm += old.place_mm;
      cube.normal += old.normal;
      cube.added += old.added;
      cube.sigma_mm += old.sigma_mm;
      cube.with_sigma += old.with_sigma;
      cube.colour += old.colour;
      cube.with_colour += old.with_colour;
      cube.frames = std::max(cube.frames, old.frames);
      cube.latest = std::max(cube.latest, old.latest);
    }
    if (cubes_.size() == 1) return;
  }
}

void PreviewPoints::add(const Shot& shot, const RigidTransform& object_from_rig) {
  if (shot.views.empty()) return;
  if (edge_mm_ == 0) edge_mm_ = cell_width_mm(shot);
  ++shots_;
  const Eigen::Matrix3f rotation = object_from_rig.rotation.cast<float>();
  const Eigen::Vector3f translation = object_from_rig.translation.cast<float>();
  for (const SurfaceView& view : shot.views) {
    const std::vector<SurfaceCell>& cells = view.levels.back().cells;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const SurfaceCell& cell = cells[i];
      if (cell.sigma_mm <= 0) continue;
      Cube& cube = add(rotation * cell.place_mm + translation, rotation * cell.normal);
      if (cube.latest != shots_) ++cube.frames;
      cube.latest = shots_;
      if (!view.colours.empty()) add_colour(cube, view.colours[i]);
    }
  }
}

void PreviewPoints::add(const Mesh& mesh) {
  if (mesh.triangles.empty()) return;
  const auto& corners = mesh.triangles.front();
  if (edge_mm_ == 0) edge_mm_ = std::max(1e-3F, (mesh.vertices_mm[corners[1]] - mesh.vertices_mm[corners[0]]).norm());
  has_sigma_ = !mesh.sigma_mm.empty();
  const std::vector<Eigen::Vector3f> normals = normals_of(mesh);
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    Cube& cube = add(mesh.vertices_mm[i], normals[i]);
    if (!mesh.colours.empty()) add_colour(cube, mesh.colours[i]);
    if (!mesh.frames.empty()) cube.frames = std::max<std::uint32_t>(cube.frames, mesh.frames[i]);
    if (!has_sigma_ || std::isnan(mesh.sigma_mm[i])) continue;
    cube.sigma_mm += mesh.sigma_mm[i];
    ++cube.with_sigma;
  }
}

std::string PreviewPoints::to_ply() const {
  std::vector<Key> keys;
  for (const auto& [key, cube] : cubes_) keys.push_back(key);
  std::ranges::sort(keys);
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment units mm\ncomment spacing_mm {:.4f}\nelement vertex {}\n",
      edge_mm_, keys.size());
  for (const char* const field : {"x", "y", "z", "nx", "ny", "nz"}) bytes += fmt::format("property float {}\n", field);
  if (has_sigma_) bytes += "property float sigma_mm\n";
  bytes += "property uchar frames\n";
  if (has_colour_) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  bytes += "end_header\n";
  for (const Key key : keys) {
    const Cube& cube = cubes_.at(key);
    put_value(bytes, Eigen::Vector3f(cube.place_mm / cube.added));
    put_value(bytes, Eigen::Vector3f(cube.normal.normalized()));
    if (has_sigma_)
      put_value(bytes, cube.with_sigma > 0 ? cube.sigma_mm / cube.with_sigma : std::numeric_limits<float>::quiet_NaN());
    put_value(bytes, static_cast<std::uint8_t>(std::min(cube.frames, 255U)));
    if (has_colour_)
      put_value(bytes, cube.with_colour > 0 ? to_rgb(cube.colour / cube.with_colour) : grey_of(kColourless));
  }
  return bytes;
}

}  // namespace slsd::model
