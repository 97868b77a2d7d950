// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string_view>

#include "core/board/board.hpp"
#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

inline constexpr std::string_view kDefaultBoard = "charuco:11x7:23:17.25:DICT_5X5_1000";

/// The board that is asked for, at the scale that its ruler was measured to have.
/// @errors kInvalidArgument: what parse_board() says; a ruler that is not NOMINAL:MEASURED, or is off by more than a
///         print can be
[[nodiscard]] Result<Board> requested_board(const CalibrateRequest& request);

/// The reference plane that is asked for, likewise; nothing where none is.
/// @errors as requested_board(); kInvalidArgument: a ruler of no plane
[[nodiscard]] Result<std::optional<Board>> requested_plane(const CalibrateRequest& request);

}  // namespace slsd
