// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/dense/cloud/part_of_cloud.hpp"
#include "core/result.hpp"
#include "daemon/configuration/frame_options.hpp"

namespace slsd {

/// The [cloud] table.
struct CloudOptions {
  std::vector<double> box = {};    ///< x y z of two corners, mm, the least first; empty: everything
  std::vector<double> plane = {};  ///< x y z of a unit normal, and offset, mm: drops what is on it or behind; or empty
  CoordinateFrame box_frame = CoordinateFrame::kRig;  ///< of box and plane
  double voxel_mm = 0;                                ///< 0 to 1000; 0: all points
  int stride = 1;                                     ///< of pixels, 1 to 64

  [[nodiscard]] Result<> validate() const;
  [[nodiscard]] bool in_base() const {
    return box_frame == CoordinateFrame::kRobotBase && !(box.empty() && plane.empty());
  }
  /// @param frame_from_rig  into the frame of box and plane
  [[nodiscard]] CloudPart part(const RigidTransform& frame_from_rig) const;
  friend bool operator==(const CloudOptions&, const CloudOptions&) = default;
};

}  // namespace slsd
