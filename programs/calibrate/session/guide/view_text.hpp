// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "programs/calibrate/session/guide/board_view.hpp"

namespace slsd {

/// A view as a line for the terminal. For each camera: "left: 60 corners, edges 0.6 px, clipped 0 %", or why it sees no
/// board.
/// @param cameras  their names
/// @thread reentrant
[[nodiscard]] std::string view_text(const BoardSightings& sightings, const std::vector<std::string>& cameras);

/// The reasons why cameras see no board, one line each, each after a line end.
/// @thread reentrant
[[nodiscard]] std::string unseen_text(const BoardSightings& sightings, const std::vector<std::string>& cameras);

}  // namespace slsd
