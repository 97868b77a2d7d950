// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/homography.hpp"

namespace slsd {

/// A place on a board and where it is in the image.
struct Tie {
  Eigen::Vector2d board;  ///< mm
  Eigen::Vector2d pixel;
};

/// The pixel of a place on the board by least squares over all ties, at least four.
/// @return nothing where they do not determine it
/// @thread reentrant
[[nodiscard]] std::optional<Homography> fit_homography(std::span<const Tie> ties);

/// The largest set of ties, as indices, that one homography explains to within a tolerance. Draws from a fixed seed.
/// @param tolerance_px  distance in the image
/// @return              empty where there are fewer than four
/// @thread reentrant
[[nodiscard]] std::vector<std::size_t> consensus(std::span<const Tie> ties, double tolerance_px);

}  // namespace slsd
