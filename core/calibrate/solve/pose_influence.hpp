// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/calibrate/solve/bundle.hpp"
#include "core/result.hpp"

namespace slsd {

/// Evidence of one pose about the others' solution.
struct HeldOut {
  double corner_rms_px = 0;  ///< its corners under the rig that the other poses give, its own pose fitted
  double symbol_rms_px = 0;  ///< the same of its symbols
  double disagreement = 0;   ///< between what it says of the shared parameters and what the others say: root mean
                             ///< square, standard deviations of the noise
  double directions = 0;     ///< number of directions in which it and the others both say something
  bool placed = true;        ///< whether its own points say where it is; if not, it says nothing, and the rest is 0
};

/// Information of the poses about the shared parameters, from the linear equations at the solution: each pose is left
/// out in turn, without solving anew.
struct PoseInfluence {
  Eigen::MatrixXd covariance;     ///< shared parameters, from the points and the priors
  double scatter = 1;             ///< factor by which the poses differ in their evidence beyond their points' noise,
                                  ///< as on a board that is not quite flat; the covariance contains it
  std::vector<HeldOut> held_out;  ///< one to a pose

  /// One standard deviation of a shared parameter.
  [[nodiscard]] double sigma(std::size_t parameter) const;
};

/// Tells whether the rest of a pose's points gives its place: at least four points that are not all symbols. Symbols
/// alone tell the board's plane, and not the board's place on it.
/// @thread reentrant
[[nodiscard]] bool is_placed(const PoseEquations& pose);

/// Poses that are not placed have no part.
/// @errors kImpossible: the poses leave a parameter open; the message names it
/// @thread reentrant
[[nodiscard]] Result<PoseInfluence> find_influence(const BundleEquations& equations);

/// "camera 0's fx", "the projector's place (z)".
[[nodiscard]] std::string name_of(const SharedParameter& parameter);
/// "fx", "turn_x" ...
[[nodiscard]] std::string short_name_of(const SharedParameter& parameter);

}  // namespace slsd
