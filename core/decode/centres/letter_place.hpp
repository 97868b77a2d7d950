// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "core/decode/centres/align_letters.hpp"
#include "core/decode/grid/sightings.hpp"

namespace slsd {

/// Number of holders up to which a surface may end beside them, or turn away from them.
inline constexpr int kFewHolders = 2;

/// The neighbour in a direction that stands for now, on the cell that lies there; -1: none. Its link may be broken, as
/// the centroid of what is worn lies elsewhere.
[[nodiscard]] std::int32_t holder_of(const Sightings& seen, std::int32_t node, Direction d);

/// Place of a symbol between accepted neighbours on both sides, or one step on from two in a line; the mean of these.
/// Without such neighbours there is no place.
[[nodiscard]] LetterPlace place_by_neighbours(const Sightings& seen, std::int32_t node);

/// Place of a symbol on a plane through the symbols around it, worn ones included. The proposed cells of these must lie
/// beside each other as the symbols do. Print wears each symbol differently. There is no place if they are few, or lie
/// on no plane.
/// @param around  holds them; its memory is kept
[[nodiscard]] LetterPlace place_by_plane(const Sightings& seen, std::int32_t node, float pitch_px,
                                         std::vector<std::int32_t>& around);

}  // namespace slsd
