// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

inline constexpr int kCoverageColumns = 8, kCoverageRows = 6;

/// Distribution of points over a device's image: their number in each cell of a coarse grid.
struct Coverage {
  std::array<int, kCoverageColumns * kCoverageRows> counts{};

  void add(const Eigen::Vector2d& pixel, const ImageSize& size);
  /// Share of the cells with any point: 0 to 1.
  [[nodiscard]] double share() const;
  /// "the upper left", "the right": the region with the fewest points; empty if all regions have some.
  [[nodiscard]] std::string emptiest() const;
};

[[nodiscard]] Coverage camera_coverage(const Observations& observations, std::size_t camera);
[[nodiscard]] Coverage projector_coverage(const Observations& observations);

/// The board's tilt relative to the first camera's axis, degrees, one for each pose.
[[nodiscard]] std::vector<double> tilts_deg(const RigModel& rig);

/// The board's distances, mm along the first camera's axis, one for each pose.
[[nodiscard]] std::vector<double> distances_mm(const RigModel& rig);

}  // namespace slsd
