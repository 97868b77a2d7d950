// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/cloud/cloud.hpp"

namespace slsd {

/// Binary PCD 0.7 with the fields of the PLY (intensity as a float), organised on the pattern's lattice: WIDTH
/// lattice_columns, HEIGHT lattice_rows times cameras (one camera's lattice below the other's); NaN where there is no
/// point. A point outside the lattice has no place and is left out.
/// @thread reentrant
[[nodiscard]] std::string write_pcd(const Cloud& cloud);

}  // namespace slsd
