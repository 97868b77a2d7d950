// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"

namespace slsd {

/// The side of a plane to which its normal points.
struct HalfSpace {
  Eigen::Vector3d normal;  ///< of length 1
  double offset_mm;        ///< of the plane from the origin, along the normal

  [[nodiscard]] bool contains(const Eigen::Vector3d& point) const { return normal.dot(point) > offset_mm; }
  /// The same side in another frame. @param frame_from_other  from that frame into this one's
  [[nodiscard]] HalfSpace in(const RigidTransform& frame_from_other) const {
    return {frame_from_other.rotation.transpose() * normal, offset_mm - normal.dot(frame_from_other.translation)};
  }
  friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

}  // namespace slsd
