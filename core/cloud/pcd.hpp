// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/cloud/cloud.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Binary PCD 0.7 with the fields of the PLY (intensity as a float), organised on the pattern's lattice. WIDTH is
/// lattice_columns, HEIGHT is lattice_rows times cameras (the cameras' lattices one below the other). Cells without a
/// point are NaN. Points outside the lattice are left out.
/// @param base_from_rig  takes the points into the robot's base; null: they stay in the rig's frame
/// @thread reentrant
[[nodiscard]] std::string write_pcd(const Cloud& cloud, const RigidTransform* base_from_rig = nullptr);

}  // namespace slsd
