// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "clients/model/places/pair_sums.hpp"
#include "clients/model/places/shot.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd::model {

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
  /// Standard deviation of the least certain motion, in pixels of the shot.
  double uncertain_px = 0;
};

/// Moves a shot onto references: distances from points to planes, weighted by 1/sigma^2 of both, each point paired with
/// what lies at its pixel in the reference (Blais and Levine 1995), from coarse to fine cells. Sharp edges hold where
/// planes slide.
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

}  // namespace slsd::model
