// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/board_sighting.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A board in the picture of one camera.
struct CameraSighting {
  std::size_t camera = 0;  ///< index in the calibration
  BoardSighting sighting;
};

/// Errors that all views of a session share, each with a deviation: the scale of the print, then fx fy cx cy (px) of
/// each camera of the calibration.
struct SharedErrors {
  Eigen::VectorXd sigma;

  static constexpr int kPrintScale = 0;
  /// @param print_scale  one standard deviation of the print's scale, a share
  [[nodiscard]] static SharedErrors of(const Calibration& calibration, double print_scale);
};

/// Place of a board, from its corners in calibrated cameras. Small motions are six numbers: a turn (rad), and a
/// shift (mm) of the board's middle, both along the axes of the rig.
struct LocatedBoard {
  RigidTransform rig_from_board;
  Eigen::Vector3d middle_mm;  ///< the middle of the seen corners, in the board's frame
  Matrix6d normal;            ///< inverse of the covariance for corners with a noise of 1 px
  Eigen::MatrixXd by_shared;  ///< 6 rows; the motion per unit of each shared error
  double squares_px2 = 0;     ///< sum of squared residuals
  std::size_t corners = 0;

  [[nodiscard]] double degrees_of_freedom() const { return 2.0 * static_cast<double>(corners) - 6; }
};

/// Locates a board by the least squares of its corners' residuals, from both solutions that a plane has.
/// @param sightings  of one moment, by one camera or more
/// @errors kNotFound: fewer than 6 corners, or corners that determine no place
/// @thread reentrant
[[nodiscard]] Result<LocatedBoard> locate_board(std::span<const CameraSighting> sightings, const Board& board,
                                                const Calibration& calibration);

/// One standard deviation of a corner's coordinate, px, from the residuals of all views; at least what find_board()
/// promises.
[[nodiscard]] double corner_noise_px(std::span<const LocatedBoard> boards);

}  // namespace slsd
