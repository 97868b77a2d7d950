// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Mounting of a scanner, and of the board that calibrates it.
///
///     kArm:  base -> flange -> scanner ~> board <- base      the board stands in the cell
///     kCell: base -> scanner ~> board <- flange <- base      the board is on the arm
enum class Mounted { kArm, kCell };

}  // namespace slsd
