// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/calibrate/solve/bundle.hpp"
#include "core/result.hpp"

namespace slsd {

/// What one pose says about the others' solution.
struct HeldOut {
  double corner_rms_px = 0;  ///< of its corners under the rig that the other poses give, its own pose fitted
  double symbol_rms_px = 0;  ///< the same of its symbols
  double disagreement = 0;   ///< between what it says of the shared parameters and what the others say: root mean
                             ///< square, standard deviations of the noise
  double directions = 0;     ///< in how many directions it and the others both say something
  bool placed = true;        ///< whether its own points say where it is; if not, it says nothing, and the rest is 0
};

/// How well the poses determine the shared parameters, from the linear equations at the solution: each pose is left out
/// in turn, without solving anew.
struct PoseInfluence {
  Eigen::MatrixXd covariance;  ///< of the shared parameters: of what the points and what was plausible before say
  double scatter = 1;          ///< by how much more the poses differ in what they say of them than their points' noise
                               ///< lets expect, as where the board is not quite flat; the covariance contains it
  std::vector<HeldOut> held_out;  ///< one to a pose

  /// One standard deviation of a shared parameter.
  [[nodiscard]] double sigma(std::size_t parameter) const;
};

/// Whether what is left of a pose's points says where it is: four points at the least, that are not all symbols.
/// Symbols alone tell the board's plane, and not where on it the board is.
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
