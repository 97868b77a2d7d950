// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// The surface that the symbols of a pose were seen on, against the plane that its corners say.
struct LitSurface {
  double offset_mm = 0;     ///< place of the symbols' middle, along the plane's normal
  double tilt_deg = 0;      ///< between the symbols' own plane and the board's
  double bow_mm = 0;        ///< height of the smooth bend over the symbols, lowest to highest
  double bow_share = 0;     ///< share of the variance off their own plane that the bend explains: 0 to 1
  double flatness_mm = 0;   ///< root mean square off their own plane
  double before_share = 0;  ///< share of the symbols before the board, less those as far behind it
  double before_mm = 0;     ///< half of those lie farther before it

  /// Largest distance that the board's edge moved.
  [[nodiscard]] double shift_mm(double half_size_mm) const;
};

/// Triangulates the symbols of a pose and fits a plane and a surface of second order to them, in the board's frame;
/// misread symbols have no part.
/// @thread reentrant
[[nodiscard]] LitSurface measure_lit_surface(const PoseObservation& pose, const RigModel& rig,
                                             const MotionVector& rig_from_board);

/// Half the diagonal of what was seen of the board.
[[nodiscard]] double half_size_mm(const PoseObservation& pose);

}  // namespace slsd
