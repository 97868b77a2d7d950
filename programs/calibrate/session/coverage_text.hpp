// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/observe/observations.hpp"

namespace slsd {

/// Draws the poses' coverage of each camera's picture and of the projector's image, with letters side by side:
///
///     camera left       projector
///     . . o # # o . .   . o # # # # o .
///
/// where . is nothing, o a few points and # many.
/// @return lines, each ended
/// @thread reentrant
[[nodiscard]] std::string coverage_text(const Observations& observations);

}  // namespace slsd
