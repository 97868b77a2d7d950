// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"

namespace slsd::model {

/// The sides from which a turning object was seen: angles about the axis of its turns, from the first view on.
struct SeenSides {
  double seen_degrees = 0;            ///< 360 minus the widest gap between two views
  double gap_begins_degrees = 0;      ///< of the widest gap, in the direction of the turn
  double gap_degrees = 360;           ///< its width
  std::vector<double> views_degrees;  ///< of each view, in order; none if there is no axis

  /// Tells whether neighbouring views are at most 30 degrees apart all the way round: each place of a ring about the
  /// axis was then seen from within 15 degrees of its own side.
  [[nodiscard]] bool all() const { return gap_degrees <= 30; }
};

/// Finds the sides that were seen. The axis is that of the turns between successive views.
/// @param object_from_rig  place of the object in each view
/// @param middle_mm        middle of the object, in the object's frame
/// @thread                 reentrant
[[nodiscard]] SeenSides seen_sides(std::span<const RigidTransform> object_from_rig, const Eigen::Vector3d& middle_mm);

/// "seen 210 of 360 degrees; missing: 210 to 360 degrees after the first view"
[[nodiscard]] std::string to_string(const SeenSides& sides);

}  // namespace slsd::model
