// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/calibrate/solve/lens_terms.hpp"
#include "core/calibrate/solve/rig_model.hpp"
#include "core/result.hpp"

namespace slsd {

struct BundleOptions {
  std::vector<DistortionPrior> cameras;  ///< one for each camera
  DistortionPrior projector = kUsualDistortion;
  bool with_symbols = true;  ///< otherwise only the cameras and poses are adjusted
  bool scale = false;        ///< whether to adjust the board's scale, relative to the reference plane's
  bool stretch = false;      ///< whether to adjust the board's aspect ratio
  /// Prior of the board's bend: one standard deviation of each term of its shape. Empty: the shape is fixed.
  std::optional<ShapeVector> shape_sigma_mm = {};
  int iterations_max = 60;
  double corner_sigma_px = 0.1;
  double plane_corner_sigma_px = 0.1;  ///< for the reference plane's corners
  double symbol_sigma_factor = 1;      ///< factor of ProjectedPoint::sigma_px
  /// Error common to all symbols of a view, which more symbols do not reduce: skewed light out of focus, or an exposure
  /// that moved. docs/notes/2026-11-calibration.md has the measurements.
  double symbol_shift_px = 0.005;

  [[nodiscard]] double corner_sigma_of(PoseSubject subject) const {
    return subject == PoseSubject::kBoard ? corner_sigma_px : plane_corner_sigma_px;
  }
};

/// Result of an adjustment.
struct Adjusted {
  bool settled = false;  ///< converged within its iterations; if not, the rig is the best so far
  double cost = 0;       ///< half of the sum of all squared residuals, reduced by the loss function
};

/// Adjusts a rig to its observations: all lenses, the devices' places, all poses, and the symbols' shift in each view
/// (Ceres, Huber's loss). Points marked as outlying are ignored.
/// @param rig  in: near the solution; out: the solution
/// @errors kImpossible: the adjustment found no solution
/// @thread reentrant
[[nodiscard]] Result<Adjusted> adjust(const Observations& observations, const BundleOptions& options, RigModel& rig);

/// The linearised equations of the adjustment at its solution: residuals of each pose and their derivatives. Empty if
/// all points of a pose are outlying.
struct PoseEquations {
  Eigen::MatrixXd by_shared;  ///< residuals x shared parameters
  /// Residuals x the pose's own parameters: its place (6), then the symbols' shift in each view (2 each, at 0).
  Eigen::MatrixXd by_pose;
  Eigen::VectorXd pose_weight;  ///< one for each column of by_pose: weight of the prior; 0: no prior
  Eigen::VectorXd residuals;    ///< standard deviations, two to a point: first the corners, then the symbols, by view
  Eigen::VectorXd sigmas_px;    ///< one for each residual: its standard deviation in px, without the loss function
  Eigen::Index corner_residuals = 0;
};

/// One adjusted parameter that all poses share.
struct SharedParameter {
  enum class Kind { kLens, kMotion, kMovedTo, kShape, kScale, kStretch };
  Kind kind;
  int device;  ///< index of the camera, or -1: the projector
  int index;   ///< in LensVector, MotionVector or ShapeVector
};

struct BundleEquations {
  std::vector<SharedParameter> shared;
  Eigen::VectorXd prior_weight;  ///< one for each shared parameter: weight of the prior; 0: no prior
  Eigen::VectorXd prior_pull;    ///< the prior's part of the gradient
  std::vector<PoseEquations> poses;
};

/// @errors kImpossible: a symbol's ray misses the board's shape
[[nodiscard]] Result<BundleEquations> linearise(const Observations& observations, const BundleOptions& options,
                                                RigModel rig);

}  // namespace slsd
