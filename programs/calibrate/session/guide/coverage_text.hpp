// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/observe/observations.hpp"

namespace slsd {

/// Draws the coverage of each camera's picture and of the projector's image side by side, in letters:
///
///     camera left       projector
///     . . o # # o . .   . o # # # # o .
///
/// In the drawing, . means no points, o a few and # many.
/// @return lines, each with its line end
/// @thread reentrant
[[nodiscard]] std::string coverage_text(const Observations& observations);

}  // namespace slsd
