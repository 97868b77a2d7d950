// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/mesh/mesh.hpp"

namespace slsd {

/// A tetrahedron of 30 mm at a scanner's distance, seen from outside, with a value of its own at each corner.
inline Mesh tetrahedron() {
  return {.vertices_mm = {{10, 20, 600}, {40, 20, 600}, {10, 50, 600}, {10, 20, 630}},
          .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
          .sigma_mm = {0.125F, 0.25F, 0.5F, 1},
          .intensity = {0, 51, 102, 255},
          .frames = {}};
}

}  // namespace slsd
