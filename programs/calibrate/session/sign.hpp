// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/calibrate/observe/observations.hpp"
#include "core/image.hpp"

namespace slsd {

/// The projector's signs to the operator, who looks at the board and not at the terminal.
enum class Sign {
  kHold,   ///< two bars: keep it still
  kTaken,  ///< a tick: the pose is taken, go on to the next
  kAgain,  ///< a turning arrow: not taken
};

/// A large dark sign on white, so that the board stays lit.
/// @param centre_px  where on the projector's image; moved so that all of the sign is in it
/// @thread reentrant
[[nodiscard]] Grey8 draw_sign(Sign sign, const ImageSize& projector, const Eigen::Vector2d& centre_px);

}  // namespace slsd
