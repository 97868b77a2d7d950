// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// The surface on which the symbols of a pose lie, relative to the plane through its corners.
struct LitSurface {
  double offset_mm = 0;     ///< distance of the symbols' centre along the plane's normal
  double tilt_deg = 0;      ///< angle between the symbols' own plane and the board's
  double bow_mm = 0;        ///< range of the smooth bend's height over the symbols, lowest to highest
  double bow_share = 0;     ///< share of the variance about the symbols' plane that the bend explains: 0 to 1
  double flatness_mm = 0;   ///< root mean square distance from the symbols' own plane
  double before_share = 0;  ///< share of the symbols before the board, minus the share equally far behind it
  double before_mm = 0;     ///< median distance of those before it

  /// Largest displacement of the board's edge.
  [[nodiscard]] double shift_mm(double half_size_mm) const;
};

/// Triangulates the symbols of a pose, and fits a plane and a second-order surface to them, in the board's frame.
/// Misread symbols get no weight.
/// @thread reentrant
[[nodiscard]] LitSurface measure_lit_surface(const PoseObservation& pose, const RigModel& rig,
                                             const MotionVector& rig_from_board);

/// Half the diagonal of the visible part of the board.
[[nodiscard]] double half_size_mm(const PoseObservation& pose);

}  // namespace slsd
