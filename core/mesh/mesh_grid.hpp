// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/cloud/point_grid.hpp"
#include "core/mesh/mesh.hpp"

namespace slsd {

/// Joins the points of adjacent pixels to triangles. The surface stays open at holes and at edges in depth:
///
///     a---b    a and b are joined if they are of one camera and their distance from each other is at most
///     | / |    `jump` of their distance from the rig's origin. A point whose sigma is a third of that or more
///     c---d    cannot tell an edge from a slope, and is left out.
///
/// Of the two diagonals the shorter one is taken, or the one that gives more triangles.
/// @param jump  as a share of the distance, such as kDepthJump
/// @return      vertices row by row, each a corner of some triangle
/// @thread      reentrant
[[nodiscard]] Mesh mesh_grid(const PointGrid& grid, float jump);

}  // namespace slsd
