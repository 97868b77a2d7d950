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
  Eigen::AlignedBox2d sheet_mm;  ///< the area that is judged, in the board's frame
  BoardShape shape;              ///< alike in all poses; the calibration is corrected for it
  double bend_mm = 0;            ///< height of the shape, from its lowest to its highest place
  double bend_sigma_mm = 0;      ///< one standard deviation of that
  double uneven_mm = 0;          ///< root mean square of what the shape leaves, alike in all poses
  double uneven_times = 0;       ///< its square over what chance lets expect

  /// The longer side.
  [[nodiscard]] double size_mm() const { return sheet_mm.isEmpty() ? 0 : sheet_mm.sizes().maxCoeff(); }
  /// Tells whether the board is bent beyond doubt, and by more than a good print is.
  [[nodiscard]] bool is_bent() const;
  /// Tells whether the poses show if the board is bent.
  [[nodiscard]] bool is_told() const;
  /// Tells whether the board has a shape that the adjustment does not describe.
  [[nodiscard]] bool is_uneven() const;
};

/// Finds the area of the board that is seen, from corner to corner.
/// @thread reentrant
[[nodiscard]] Eigen::AlignedBox2d seen_of_board(const Observations& observations);

/// Judges the board's shape by the adjustment at its solution.
/// @param sheet_mm  the board with its border, in the board's frame
/// @thread reentrant
[[nodiscard]] BoardReport judge_board(const Observations& observations, const RigModel& rig,
                                      const std::vector<SharedParameter>& shared, const PoseInfluence& influence,
                                      const Eigen::AlignedBox2d& sheet_mm);

/// Describes the bend for a person: "bent by 0.53 +- 0.02 mm over its 336 mm".
[[nodiscard]] std::string bend_text(const BoardReport& board);

/// Describes for a person the board's flatness and what was done about it.
[[nodiscard]] std::string board_text(const BoardReport& board);

/// Lists the faults of the board that keep a calibration from being good.
[[nodiscard]] std::vector<std::string> board_warnings(const BoardReport& board);

}  // namespace slsd
