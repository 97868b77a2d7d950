// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "clients/model/places/surface_cells.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd::model {

/// A shot whose place is known.
struct PlacedShot {
  const Shot* shot = nullptr;
  RigidTransform object_from_rig;  ///< at the time of this shot
};

/// A motion that the surface does not determine: it slides on itself.
struct FreeMotion {
  bool turns = false;          ///< a turn about `axis` through `through_mm`; else a shift along `axis`
  Eigen::Vector3d axis;        ///< unit vector in the rig's frame
  Eigen::Vector3d through_mm;  ///< in the rig's frame
};

/// "turning about the axis (0.00, 1.00, 0.00) through (1, 2, 700) mm"
[[nodiscard]] std::string to_string(const FreeMotion& motion);

struct Alignment {
  RigidTransform object_from_rig;
  std::size_t pairs = 0;  ///< cells of the shot that lie on a cell of a reference
  double overlap = 0;     ///< their share of the cells that a reference could see
  double fit = 0;         ///< usual distance between two surfaces over its sigma: 1 if the sigmas are right
  double agreeing = 0;    ///< share of the pairs within three sigma
  /// Squared normal component of the least determined motion of 1 mm, averaged over the pairs: 0 if the surface slides
  /// on itself.
  double determined = 0;
  FreeMotion least_determined;
};

/// Moves a shot onto references: distances from points to planes, weighted by 1/sigma^2 of both, each point paired with
/// what lies at its pixel in the reference (Blais and Levine 1995), from coarse to fine cells.
/// @param start  object_from_rig to begin from
/// @param first  coarsest level; a fine one needs a near start, and what moves otherwise pulls it less
/// @return       nothing if too few cells meet
/// @thread       reentrant
[[nodiscard]] std::optional<Alignment> align(const Shot& shot, std::span<const PlacedShot> references,
                                             const RigidTransform& start, std::size_t first = 0);

/// Tells whether an alignment lays a shot onto its references, even if the surface slides on itself.
[[nodiscard]] bool fits(const Alignment& alignment);

/// The reason why an alignment does not put a shot into a model; empty if it does.
[[nodiscard]] std::string refusal_of(const Alignment& alignment);

/// Calls visit(cell, reference cell, position of the cell in the reference's rig frame) for pairs at a level. Foreign
/// cells have none.
/// @param gate_mm  the farthest that two surfaces of a pair may be apart
template <class Visit>
void visit_pairs(const Shot& shot, const RigidTransform& reference_from_rig, const Shot& reference, std::size_t level,
                 float gate_mm, Visit&& visit) {
  constexpr float kAlike = 0.7F;  // cosine between normals
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
                          other->normal.dot(rotation * cell.normal) > kAlike;
        visit(cell, near ? other : nullptr, place);
      }
    }
  }
}

}  // namespace slsd::model
