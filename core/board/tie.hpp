// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/homography.hpp"

namespace slsd {

/// A position on a board and its pixel in the image.
struct Tie {
  Eigen::Vector2d board;  ///< mm
  Eigen::Vector2d pixel;
};

/// Predicts the pixel of a position on the board by least squares over all ties, at least four.
/// @return empty if the ties do not determine it
/// @thread reentrant
[[nodiscard]] std::optional<Homography> fit_homography(std::span<const Tie> ties);

/// The largest set of ties, as indices, that one homography explains within a tolerance. Draws samples from a fixed
/// seed.
/// @param tolerance_px  distance in the image
/// @return              empty if there are fewer than four
/// @thread reentrant
[[nodiscard]] std::vector<std::size_t> consensus(std::span<const Tie> ties, double tolerance_px);

}  // namespace slsd
