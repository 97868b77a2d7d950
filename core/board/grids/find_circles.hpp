// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"
#include "core/result.hpp"

namespace slsd {

/// find_board() for a board of circles. OpenCV's search finds the discs. Then each disc's centroid by grey levels is
/// corrected by the distance of the ellipse's centre from the image of the disc's centre. With R the radius and H the
/// homography around the disc, the ellipse is H^-T diag(1, 1, -R^2) H^-1 (Heikkila 2000, "Geometric camera calibration
/// using circular control points").
/// @errors as find_board()
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_circles(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
