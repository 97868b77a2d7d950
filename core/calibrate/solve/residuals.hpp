// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <ceres/sized_cost_function.h>
#include <Eigen/Core>

#include "core/calibrate/solve/board_shape.hpp"

namespace slsd {

/// A point of the board in the camera: predicted minus observed place, in standard deviations. The print is larger than
/// stated by `scale`, and by `stretch` along y. Blocks: the camera's lens and place, the board's place, scale, stretch,
/// shape.
class CornerResidual final : public ceres::SizedCostFunction<2, 9, 6, 6, 1, 1, static_cast<int>(kShapeTerms)> {
 public:
  CornerResidual(const Eigen::Vector2d& camera_px, const Eigen::Vector2d& board_mm, double sigma_px,
                 const ShapeFrame& frame)
      : camera_px_(camera_px), board_mm_(board_mm), sigma_px_(sigma_px), frame_(frame) {}
  bool Evaluate(const double* const* blocks, double* residual, double** slopes) const override;

 private:
  Eigen::Vector2d camera_px_, board_mm_;
  double sigma_px_;
  ShapeFrame frame_;
};

/// A projector pixel in the camera: its ray meets the board, and the camera sees that point. The pixel is exact; the
/// camera's observation has the error. Blocks: the camera's lens and place, the projector's lens and place, the board's
/// place, the shift of all symbols of the view (px of the camera), and the board's shape. Evaluation fails if the ray
/// misses the shape: Ceres then rejects the trial step.
class SymbolResidual final : public ceres::SizedCostFunction<2, 9, 6, 9, 6, 6, 2, static_cast<int>(kShapeTerms)> {
 public:
  SymbolResidual(const Eigen::Vector2d& camera_px, const Eigen::Vector2d& projector_px, double sigma_px,
                 const ShapeFrame& frame)
      : camera_px_(camera_px), projector_px_(projector_px), sigma_px_(sigma_px), frame_(frame) {}
  bool Evaluate(const double* const* blocks, double* residual, double** slopes) const override;

 private:
  Eigen::Vector2d camera_px_, projector_px_;
  double sigma_px_;
  ShapeFrame frame_;
};

}  // namespace slsd
