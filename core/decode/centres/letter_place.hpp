// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

#include "core/decode/centres/align_letters.hpp"
#include "core/decode/grid/sightings.hpp"

namespace slsd {

/// Number of supporters up to which a surface may end, or turn away, beside the symbol.
inline constexpr int kFewSupporters = 2;

/// The neighbour in a direction that is decoded for now, on the cell that lies there; -1: none. Its link may be broken,
/// because the centroid of a degraded symbol is displaced.
[[nodiscard]] std::int32_t supporter_of(const Sightings& seen, std::int32_t node, Direction d);

/// Place of a symbol between accepted neighbours on opposite sides, or one step beyond two in a line; the mean of all
/// these. Without such neighbours there is no place.
[[nodiscard]] LetterPlace place_by_neighbours(const Sightings& seen, std::int32_t node);

}  // namespace slsd
