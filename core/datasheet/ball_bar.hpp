// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/mesh/mesh.hpp"

namespace slsd {

/// A bar with a sphere at each end, to print: three closed surfaces that overlap, which a slicer joins. The bar lies
/// along x.
/// @param spacing_mm  between the centres, more than the diameter
/// @thread reentrant
[[nodiscard]] Mesh ball_bar(double diameter_mm, double spacing_mm);

}  // namespace slsd
