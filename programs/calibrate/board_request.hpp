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

/// The requested board, at the scale of its measured ruler.
/// @errors kInvalidArgument: errors of parse_board(); a ruler that is not NOMINAL:MEASURED, or is off by more than a
///         print can be
[[nodiscard]] Result<Board> requested_board(const CalibrateRequest& request);

/// The requested reference plane, at the scale of its ruler; nothing if none is requested.
/// @errors as requested_board(); kInvalidArgument: a ruler without a plane
[[nodiscard]] Result<std::optional<Board>> requested_plane(const CalibrateRequest& request);

}  // namespace slsd
