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

/// A chessboard's inner corner in an image.
struct Saddle {
  Eigen::Vector2d pixel;
  double step = 0;     ///< white minus black, levels; negative if the square to the lower right is white
  double blur_px = 0;  ///< one standard deviation, across the edges
  double misfit = 0;   ///< weighted RMS residual, relative to |step|
};

/// Fits
///
///     I(p) = (m + k E(u / s) E(v / s)) (1 + g (p - c)),    E(x) = erf(x / sqrt 2),
///
/// to the pixels around a corner, where u and v are the distances from two edges through c: two step edges blurred by s
/// in light that changes linearly. The solver is Levenberg and Marquardt (Ceres' small solver), from the guess, with
/// weights that fall to 0 at reach_px. Features outside the model that are symmetrical about the corner, like a
/// ChArUco's markers, do not move c.
/// @param reach_px  at least 2.5
/// @return          empty if there is no such corner: outside the image, no contrast, no convergence, another shape
/// @thread reentrant
[[nodiscard]] std::optional<Saddle> fit_saddle(const Image<float>& light, const SaddleGuess& guess, double reach_px);

}  // namespace slsd
