// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/calibrate/correct/fit_drift.hpp"

namespace slsd {

/// Error of measured points at a depth, root mean square over the field that cameras and projector share.
struct DeviationAt {
  double depth_mm = 0;
  double before_mm = 0;  ///< points measured as calibrated, off the corrected ones
  double sigma_mm = 0;   ///< corrected points: one standard deviation
};

/// Predicts deviations of points over the field.
/// @param calibrated  before the drift
/// @param fits        all explanations of the view. They count by their evidence, so that the deviation includes the
///                    doubt which of them is true
/// @param best        index of the explanation to correct by
/// @param depths_mm   in the first camera's frame; a depth at which nothing is shared is left out
/// @thread reentrant
[[nodiscard]] std::vector<DeviationAt> deviations_at(const std::vector<double>& depths_mm, const RigModel& calibrated,
                                                     const std::vector<DriftFit>& fits, std::size_t best);

}  // namespace slsd
