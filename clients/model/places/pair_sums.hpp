// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "clients/model/places/shot.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd::model {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// A shot whose place is known.
struct PlacedShot {
  const Shot* shot = nullptr;
  RigidTransform object_from_rig;  ///< at the time of this shot
};

/// Small motions of a shot in the object's frame: a turn about `middle_mm`, in radians times `size_mm`, then a shift,
/// mm.
struct MotionScale {
  Eigen::Vector3d middle_mm;
  double size_mm;
};

/// A pose after a small motion. @param by  of the scale
[[nodiscard]] RigidTransform moved(const RigidTransform& pose, const Vector6& by, const MotionScale& scale);

/// Conditions of a pair of cells, or of edges, of two shots.
struct Pairing {
  std::size_t level = kCellSteps.size() - 1;
  float gate_mm = 0;     ///< the farthest that two surfaces of a pair may be apart
  double motion_mm = 0;  ///< distances that the motion causes, beside those of the sigmas
};

/// Sums over pairs of cells, and of edges, of two shots: distances from points to planes, and across edges, as a
/// quadratic form of a small motion.
struct PairSums {
  Matrix6 information = Matrix6::Zero();  ///< weighted by 1/sigma^2 of both sides
  Vector6 gradient = Vector6::Zero();
  std::size_t seen = 0;           ///< cells that the reference could see
  std::vector<float> over_sigma;  ///< distance of each pair of cells, over its sigma

  [[nodiscard]] std::size_t pairs() const { return over_sigma.size(); }
  /// Mean squared normal component of motions of 1 mm, where an edge counts as a pair of cells. Each pair multiplies
  /// the directions that both shots measured, whose errors are independent: their noise is no relief.
  [[nodiscard]] Matrix6 relief() const { return relief_sum / static_cast<double>(std::max<std::size_t>(1, pairs())); }
  /// Adds the sums of the same pairs with shot and reference exchanged.
  void add_opposite(const PairSums& back);

  Matrix6 relief_sum = Matrix6::Zero();  ///< for relief()
  /// The information of directions that both shots measured: without that of their noise.
  Matrix6 sure_information = Matrix6::Zero();
};

/// Adds the pairs of a shot with a reference. @thread reentrant
void add_pairs(PairSums& sums, const PlacedShot& shot, const PlacedShot& reference, const Pairing& pairing,
               const MotionScale& scale);

}  // namespace slsd::model
