// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "core/calibrate/solve/bundle.hpp"
#include "core/calibrate/solve/pose_influence.hpp"

namespace slsd {

/// Flatness of a session's board.
struct BoardReport {
  Eigen::AlignedBox2d sheet_mm;  ///< the judged area, in the board's frame
  BoardShape shape;              ///< equal in all poses; the calibration corrects for it
  double bend_mm = 0;            ///< range of the shape's height, lowest to highest
  double bend_sigma_mm = 0;      ///< one standard deviation of the bend
  double uneven_mm = 0;          ///< root mean square of the height beyond the shape, equal in all poses
  double uneven_times = 0;       ///< its square, relative to what chance explains

  /// The longer side.
  [[nodiscard]] double size_mm() const { return sheet_mm.isEmpty() ? 0 : sheet_mm.sizes().maxCoeff(); }
  /// Tells whether the board is certainly bent, and by more than a good print.
  [[nodiscard]] bool is_bent() const;
  /// Tells whether the poses determine if the board is bent.
  [[nodiscard]] bool is_known() const;
  /// Tells whether the board has a shape that the adjustment does not describe.
  [[nodiscard]] bool is_uneven() const;
};

/// Finds the visible area of the board, from corner to corner.
/// @thread reentrant
[[nodiscard]] Eigen::AlignedBox2d seen_of_board(const Observations& observations);

/// Judges the board's shape at the adjustment's solution.
/// @param sheet_mm  the board with its border, in the board's frame
/// @thread reentrant
[[nodiscard]] BoardReport judge_board(const Observations& observations, const RigModel& rig,
                                      const std::vector<SharedParameter>& shared, const PoseInfluence& influence,
                                      const Eigen::AlignedBox2d& sheet_mm);

/// Describes the bend to the user: "bent by 0.53 +- 0.02 mm over its 336 mm".
[[nodiscard]] std::string bend_text(const BoardReport& board);

/// Describes the board's flatness and the correction to the user.
[[nodiscard]] std::string board_text(const BoardReport& board);

/// Lists faults of the board that prevent a good calibration.
[[nodiscard]] std::vector<std::string> board_warnings(const BoardReport& board);

}  // namespace slsd
