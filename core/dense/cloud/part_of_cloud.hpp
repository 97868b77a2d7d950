// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/dense/cloud/dense_cloud.hpp"
#include "core/geometry/half_space.hpp"
#include "core/geometry/measured_box.hpp"

namespace slsd {

/// The part of a scan that its user wants.
struct CloudPart {
  std::optional<MeasuredBox> box = {};  ///< empty: all
  std::optional<HalfSpace> side = {};   ///< of a plane, in the rig's frame; empty: both
  double voxel_mm = 0;                  ///< keeps the most certain point of each cube of this side; 0: all
  int stride = 1;                       ///< of pixels: keeps every Nth row and column
};

/// Drops the points outside the part. Of several points in one cube, keeps the one of the least sigma; of equals, the
/// first.
/// @thread reentrant
void keep_part(std::vector<CloudPoint>& points, const CloudPart& part);
/// The same for all cameras' pixels together; counts the pixels again.
void keep_part(std::span<DenseView> views, const CloudPart& part);

}  // namespace slsd
