// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/cloud/cloud.hpp"

namespace slsd {

/// Binary PCD 0.7 with the fields of the PLY (intensity as a float), organised on the pattern's lattice. WIDTH is
/// lattice_columns, HEIGHT is lattice_rows times cameras (the cameras' lattices one below the other). Cells without a
/// point are NaN. Points outside the lattice are left out.
/// @thread reentrant
[[nodiscard]] std::string write_pcd(const Cloud& cloud);

}  // namespace slsd
