// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

#include "clients/model/places/align.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd::model {

/// Tells whether two bodies moved differently from one shot to the next: what a place does not explain of the shot has
/// a place of its own, and is too much to be noise.
/// @param placed  the shot, where it may be
/// @param before  the shot before
/// @param starts  object_from_rig to look for the other body from
/// @thread        reentrant
[[nodiscard]] bool shows_two_bodies(const PlacedShot& placed, const PlacedShot& before,
                                    std::span<const RigidTransform> starts);

}  // namespace slsd::model
