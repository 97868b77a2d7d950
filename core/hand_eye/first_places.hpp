// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

#include "core/hand_eye/hand_eye_model.hpp"

namespace slsd {

/// Places of scanner and board in closed form: the turn from quaternions of all pairs of views (Chou and Kamel 1991),
/// then both places by linear least squares. Directions that the views do not determine get the shortest solution.
/// @param views  at least two
/// @thread reentrant
[[nodiscard]] HandEyePlaces first_places(Mounted mounted, std::span<const HandEyeView* const> views);

/// The mean of rigid motions that differ little.
/// @param motions  at least one
[[nodiscard]] RigidTransform mean_of(std::span<const RigidTransform> motions);

}  // namespace slsd
