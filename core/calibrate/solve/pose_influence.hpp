// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/calibrate/solve/bundle.hpp"
#include "core/result.hpp"

namespace slsd {

/// Information of one pose, compared with the others' solution.
struct HeldOut {
  double corner_rms_px = 0;  ///< its corners under the rig from the other poses, with its own pose fitted
  double symbol_rms_px = 0;  ///< the same for its symbols
  double disagreement = 0;   ///< difference between its estimate of the shared parameters and the others' estimate:
                             ///< root mean square, standard deviations of the noise
  double directions = 0;     ///< number of directions that both it and the others determine
  bool placed = true;        ///< whether its own points determine its place; if not, it has no information, and the
                             ///< rest is 0
};

/// Information of the poses about the shared parameters, from the linearised equations at the solution: each pose is
/// left out in turn, without solving again.
struct PoseInfluence {
  Eigen::MatrixXd covariance;     ///< shared parameters, from the points and the priors
  double scatter = 1;             ///< factor by which the poses disagree beyond their points' noise, as on a board that
                                  ///< is not quite flat; the covariance includes it
  std::vector<HeldOut> held_out;  ///< one for each pose

  /// One standard deviation of a shared parameter.
  [[nodiscard]] double sigma(std::size_t parameter) const;
};

/// Tells whether the remaining points of a pose determine its place: at least four points that are not all symbols.
/// Symbols alone determine the board's plane, but not the board's place on it.
/// @thread reentrant
[[nodiscard]] bool is_placed(const PoseEquations& pose);

/// Evaluates the poses at the solution; ignores poses that are not placed.
/// @errors kImpossible: the poses do not determine a parameter; the message names it
/// @thread reentrant
[[nodiscard]] Result<PoseInfluence> find_influence(const BundleEquations& equations);

/// "camera 0's fx", "the projector's place (z)".
[[nodiscard]] std::string name_of(const SharedParameter& parameter);
/// "fx", "turn_x" ...
[[nodiscard]] std::string short_name_of(const SharedParameter& parameter);

}  // namespace slsd
