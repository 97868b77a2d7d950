// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/calibrate/correct/drift.hpp"
#include "core/calibrate/observe/observations.hpp"

namespace slsd {

/// Noise of a view's points.
struct ViewNoise {
  double corner_px = 0.1;
  double symbol_factor = 1;  ///< factor of ProjectedPoint::sigma_px
};

/// A rig whose drift explains a view best, in one explanation.
struct DriftFit {
  Explanation explanation;
  Eigen::VectorXd by;                ///< one value for each parameter
  Eigen::MatrixXd covariance;        ///< of these, with the priors
  RigModel rig;                      ///< with the drift, the board's places and its shape
  Eigen::MatrixXd shape_covariance;  ///< of the shape's terms of second order, mm^2
  /// Logarithm of the probability of the view under this explanation (Laplace's approximation), up to a constant that
  /// all explanations of a view share. A parameter that explains little lowers it.
  double log_evidence = 0;
};

enum class Weighing {
  kEqual,   ///< least squares over the points that are not outlying
  kRobust,  ///< points far off hardly count; the evidence then means nothing
};

/// Adjusts the drift, the places and bend of the board, and the shift of all symbols of a view, by Gauss and Newton.
/// The residuals and their slopes are those of a calibration.
/// @param rig   as calibrated, with the board's places near the solution and the frame of its shape
/// @return      empty if the adjustment fails, as when a ray misses the board
/// @thread reentrant
[[nodiscard]] std::optional<DriftFit> fit_drift(const Observations& observations, const RigModel& rig,
                                                const Explanation& explanation, const ViewNoise& noise,
                                                Weighing weighing);

}  // namespace slsd
