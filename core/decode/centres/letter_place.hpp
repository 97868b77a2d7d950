// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "core/decode/centres/align_letters.hpp"
#include "core/decode/grid/sightings.hpp"

namespace slsd {

/// Beside so few a surface may end, or turn away from them.
inline constexpr int kFewHolders = 2;

/// The neighbour in a direction that stands for now, on the cell that lies there; -1: none. Its link may be broken, as
/// the centroid of what is worn lies elsewhere.
[[nodiscard]] std::int32_t holder_of(const Sightings& seen, std::int32_t node, Direction d);

/// Where the neighbours that stand for now put a symbol: between those on both sides of it, or one step on from two in
/// a line; the mean. No place without such neighbours.
[[nodiscard]] LetterPlace place_by_neighbours(const Sightings& seen, std::int32_t node);

/// Where a plane puts a symbol: through those around it that are worn, too, on proposed cells that lie beside each
/// other as they do. Print wears each in another way. No place if they are few, or lie on no plane.
/// @param around  holds them; its memory is kept
[[nodiscard]] LetterPlace place_by_plane(const Sightings& seen, std::int32_t node, float pitch_px,
                                         std::vector<std::int32_t>& around);

}  // namespace slsd
