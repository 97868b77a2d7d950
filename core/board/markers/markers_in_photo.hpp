// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/markers/find_markers.hpp"
#include "core/result.hpp"

namespace slsd {

/// The board's markers that lie at their places on it, at least one.
/// @errors kNotFound (none), kMismatch (another board, another dictionary, the legacy layout, a mirrored image)
/// @thread reentrant
[[nodiscard]] Result<std::vector<SeenMarker>> markers_in_photo(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
