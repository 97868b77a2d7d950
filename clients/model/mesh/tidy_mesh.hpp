// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/mesh/mesh.hpp"

namespace slsd::model {

/// Leaves out pieces with fewer than this share of the triangles, and vertices without a triangle. Gives each fan of
/// triangles that meet in one vertex alone a vertex of its own, so that the surface is a manifold.
/// @thread reentrant
[[nodiscard]] Mesh tidy(const Mesh& mesh, double smallest_share);

}  // namespace slsd::model
