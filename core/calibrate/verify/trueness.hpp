// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/geometry/lens.hpp"
#include "core/geometry/plane_fit.hpp"

namespace slsd {

/// Trueness of measured distances between a board's points, per cent; positive: measured too long.
struct Trueness {
  std::size_t corners = 0;
  double scale_percent = 0;     ///< common factor of all distances
  double long_rms_percent = 0;  ///< root mean square over the distances of at least half the longest
  double worst_percent = 0;     ///< the largest error among these
};

/// Compares distances between a board's points with the true ones. The points are where the camera's rays meet the
/// plane of the measured symbols, so camera and projector both contribute.
/// @param corners  camera px, distorted; board mm. Outlying ones are ignored
/// @param plane    mm, in the camera's frame
/// @return         empty for fewer than four points
/// @thread reentrant
[[nodiscard]] std::optional<Trueness> measure_trueness(const std::vector<BoardPoint>& corners, const Lens& camera,
                                                       const PlaneFit& plane);

}  // namespace slsd
