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
  std::vector<DistortionPrior> cameras;  ///< one to a camera
  DistortionPrior projector = kUsualDistortion;
  bool with_symbols = true;  ///< otherwise the cameras and poses alone are adjusted
  bool scale = false;        ///< whether the board's scale is adjusted too, against that of the reference plane
  bool stretch = false;      ///< whether the board's aspect is adjusted too
  /// Bend that the board may have before any observation: one standard deviation of each term of its shape. Nothing:
  /// the shape is held as it is.
  std::optional<ShapeVector> shape_sigma_mm = {};
  int iterations_max = 60;
  double corner_sigma_px = 0.1;
  double plane_corner_sigma_px = 0.1;  ///< for the reference plane's corners
  double symbol_sigma_factor = 1;      ///< factor of ProjectedPoint::sigma_px
  /// Error that all symbols of a view share, which no number of symbols lessens: skewed light out of focus, or an
  /// exposure that moved. docs/notes/2026-11-calibration.md has the measurements.
  double symbol_shift_px = 0.005;

  [[nodiscard]] double corner_sigma_of(PoseSubject subject) const {
    return subject == PoseSubject::kBoard ? corner_sigma_px : plane_corner_sigma_px;
  }
};

/// Result of an adjustment.
struct Adjusted {
  bool settled = false;  ///< within its iterations; if not, the rig is the best so far
  double cost = 0;       ///< half of the sum of all squared residuals, lessened by the loss
};

/// Adjusts a rig to what was seen of it: all lenses, the devices' places and all poses at once (Ceres, Huber's
/// loss), and what the symbols of each view are shifted by. Points marked as outlying have no part.
/// @param rig  in: near the solution; out: the solution
/// @errors kImpossible: no solution was reached
/// @thread reentrant
[[nodiscard]] Result<Adjusted> adjust(const Observations& observations, const BundleOptions& options, RigModel& rig);

/// The equations of the adjustment at its solution, linear: residuals of each pose and their derivatives. Empty where
/// all points of a pose are outlying.
struct PoseEquations {
  Eigen::MatrixXd by_shared;  ///< residuals x shared parameters
  /// Residuals x what the pose has of its own: its place (6), then the shift of each view's symbols (2 each, at 0).
  Eigen::MatrixXd by_pose;
  Eigen::VectorXd pose_weight;  ///< one to a column of by_pose: of what was plausible before; 0: anything was
  Eigen::VectorXd residuals;    ///< standard deviations, two to a point: first the corners, then the symbols, by view
  Eigen::VectorXd sigmas_px;    ///< one to a residual: what it is in px, the loss undone
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
  Eigen::VectorXd prior_weight;  ///< one to a shared parameter: of what was plausible before; 0: anything was
  Eigen::VectorXd prior_pull;    ///< its part in the gradient
  std::vector<PoseEquations> poses;
};

/// @errors kImpossible: a symbol's ray misses the board's shape
[[nodiscard]] Result<BundleEquations> linearise(const Observations& observations, const BundleOptions& options,
                                                RigModel rig);

}  // namespace slsd
