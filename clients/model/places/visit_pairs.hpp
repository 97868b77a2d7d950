// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include "clients/model/places/shot.hpp"
#include "clients/model/places/surface_edges.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd::model {

/// Cosine between two normals, or two directions across edges, from which on both may be the same.
inline constexpr float kAlikeCosine = 0.7F;

/// Calls visit(cell, reference cell, position of the cell in the reference's rig frame) for pairs at a level. Foreign
/// cells have none.
/// @param gate_mm  the farthest that two surfaces of a pair may be apart
template <class Visit>
void visit_pairs(const Shot& shot, const RigidTransform& reference_from_rig, const Shot& reference, std::size_t level,
                 float gate_mm, Visit&& visit) {
  const Eigen::Matrix3f rotation = reference_from_rig.rotation.cast<float>();
  const Eigen::Vector3f translation = reference_from_rig.translation.cast<float>();
  for (const SurfaceView& seen : reference.views) {
    const Eigen::Matrix3f camera_rotation = seen.image.camera_from_rig.rotation.cast<float>();
    const Eigen::Vector3f camera_translation = seen.image.camera_from_rig.translation.cast<float>();
    for (const SurfaceView& view : shot.views) {
      for (const SurfaceCell& cell : view.levels[level].cells) {
        if (!(cell.sigma_mm > 0) || cell.foreign) continue;
        const Eigen::Vector3f place = rotation * cell.place_mm + translation;
        const Eigen::Vector3f in_camera = camera_rotation * place + camera_translation;
        if (!(in_camera.z() > 0)) continue;
        const Eigen::Vector2f pixel = seen.image.pixel_of(in_camera);
        const SurfaceCell* const other = seen.levels[level].at(pixel.x() + 0.5F, pixel.y() + 0.5F);
        if (other && other->foreign) continue;  // it hides the object
        const bool near = other && std::abs(other->normal.dot(place - other->place_mm)) < gate_mm &&
                          (place - other->place_mm).squaredNorm() < 4 * gate_mm * gate_mm &&
                          other->normal.dot(rotation * cell.normal) > kAlikeCosine;
        visit(cell, near ? other : nullptr, place);
      }
    }
  }
}

/// Calls visit(edge, nearest edge of the reference that may be the same, position of the edge in the reference's rig
/// frame). Edges of foreign cells have none.
/// @param gate_mm  the farthest that two edges of a pair may be apart, across them and along the normal
template <class Visit>
void visit_edge_pairs(const Shot& shot, const RigidTransform& reference_from_rig, const Shot& reference, float gate_mm,
                      Visit&& visit) {
  const Eigen::Matrix3f rotation = reference_from_rig.rotation.cast<float>();
  const Eigen::Vector3f translation = reference_from_rig.translation.cast<float>();
  for (const SurfaceView& seen : reference.views) {
    const CellGrid& grid = seen.levels.back();
    const float step = static_cast<float>(grid.step);
    const Eigen::Matrix3f camera_rotation = seen.image.camera_from_rig.rotation.cast<float>();
    const Eigen::Vector3f camera_translation = seen.image.camera_from_rig.translation.cast<float>();
    for (const SurfaceView& view : shot.views) {
      for (const SurfaceEdge& edge : view.edges.edges) {
        if (view.levels.back().cells[edge.cell].foreign) continue;
        const Eigen::Vector3f place = rotation * edge.place_mm + translation;
        const Eigen::Vector3f normal = rotation * edge.normal, across = rotation * edge.across;
        const Eigen::Vector3f in_camera = camera_rotation * place + camera_translation;
        if (!(in_camera.z() > 0)) continue;
        const Eigen::Vector2f pixel = seen.image.pixel_of(in_camera);
        const SurfaceEdge* nearest = nullptr;
        float nearest_mm2 = 4 * gate_mm * gate_mm;
        const auto compare = [&](std::size_t cell) {
          const SurfaceEdge* const other = seen.edges.of(cell);
          if (!other || grid.cells[other->cell].foreign) return;
          const Eigen::Vector3f off = place - other->place_mm;
          if (off.squaredNorm() >= nearest_mm2 || std::abs(other->across.dot(off)) > gate_mm ||
              std::abs(other->normal.dot(off)) > gate_mm || other->normal.dot(normal) < kAlikeCosine ||
              other->across.dot(across) < kAlikeCosine)
            return;
          nearest_mm2 = off.squaredNorm(), nearest = other;
        };
        const float gate_px = gate_mm * static_cast<float>(seen.image.lens.fx) / in_camera.z();
        visit_cells_around(grid, static_cast<int>(std::floor(pixel.x() / step)),
                           static_cast<int>(std::floor(pixel.y() / step)), 1 + static_cast<int>(gate_px / step),
                           compare);
        if (nearest) visit(edge, *nearest, place);
      }
    }
  }
}

}  // namespace slsd::model
