// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/find_board.hpp"
#include "core/board/tie.hpp"
#include "core/calibrate/observe/observations.hpp"

namespace slsd {

/// The place of a board in front of an uncalibrated camera. Its focal length is guessed, so angles and distances serve
/// only to compare poses.
struct BoardPlace {
  Eigen::Vector2d centre;  ///< the board's centre, as a share of the image's width and height
  Eigen::Vector3d normal;  ///< the board's normal, away from the camera, in the camera's frame, of length 1
  double distance_mm = 0;  ///< distance of the board's centre
  double turn_rad = 0;     ///< angle of the board's x axis in the image, from x towards y

  /// The angle between the board and the image plane, 0 to 90 degrees.
  [[nodiscard]] double tilt_deg() const;
};

/// @param ties  points on the board and their pixels
/// @return nothing if the points do not determine it
/// @thread reentrant
[[nodiscard]] std::optional<BoardPlace> place_of(std::span<const Tie> ties, const Board& board, const ImageSize& size);

/// Tells whether two poses are so similar that the second adds no information. Their centres are within a sixth of the
/// image, and tilt, turn and distance are alike.
/// @thread reentrant
[[nodiscard]] bool are_alike(const BoardPlace& a, const BoardPlace& b);

[[nodiscard]] std::vector<Tie> ties_of(const BoardSighting& sighting, const Board& board);
[[nodiscard]] std::vector<Tie> ties_of(const PoseView& view);

}  // namespace slsd
