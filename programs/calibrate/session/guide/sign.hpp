// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/calibrate/observe/observations.hpp"
#include "core/image.hpp"

namespace slsd {

/// The projector's signs to the operator, who looks at the board, not at the terminal.
enum class Sign {
  kHold,   ///< two bars: keep the board still
  kTaken,  ///< a tick: the pose was taken, go on
  kAgain,  ///< a turning arrow: not taken
};

/// A large dark sign on white, which keeps the board lit.
/// @param centre_px  place in the projector's image; moved so that the whole sign fits
/// @thread reentrant
[[nodiscard]] Grey8 draw_sign(Sign sign, const ImageSize& projector, const Eigen::Vector2d& centre_px);

}  // namespace slsd
