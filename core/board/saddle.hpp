// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

/// Expected place of a chessboard's inner corner, with the steps to the next corners on the board.
struct SaddleGuess {
  Eigen::Vector2d pixel;
  Eigen::Vector2d right;  ///< step to the next corner to the right on the board, px
  Eigen::Vector2d down;   ///< step to the next corner below, px

  /// Distance from the corner to the nearer of the next edges, px.
  [[nodiscard]] double square_px() const;
};

/// A chessboard's inner corner, as seen.
struct Saddle {
  Eigen::Vector2d pixel;
  double step = 0;     ///< white less black, levels; negative where the square to the lower right is white
  double blur_px = 0;  ///< one standard deviation, across the edges
  double misfit = 0;   ///< weighted RMS of what the fit leaves, of |step|
};

/// Fits
///
///     I(p) = (m + k E(u / s) E(v / s)) (1 + g (p - c)),    E(x) = erf(x / sqrt 2),
///
/// to the pixels around a corner, where u and v are the distances from two edges through c: two step edges blurred by
/// s under a light that changes linearly. By Levenberg and Marquardt (Ceres' small solver) from the guess, with weights
/// that fall to 0 at reach_px. What is not of the model but symmetrical about the corner, as a ChArUco's markers are,
/// does not move c.
/// @param reach_px  at least 2.5
/// @return          nothing where no such corner is: outside the image, no contrast, no convergence, another shape
/// @thread reentrant
[[nodiscard]] std::optional<Saddle> fit_saddle(const Image<float>& light, const SaddleGuess& guess, double reach_px);

}  // namespace slsd
