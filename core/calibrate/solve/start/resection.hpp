// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

#include <Eigen/Core>

#include "core/calibrate/solve/rig_model.hpp"
#include "core/result.hpp"

namespace slsd {

/// A point in space and its pixel in a device.
struct SpacePoint {
  Eigen::Vector3d point_mm;
  Eigen::Vector2d pixel;
};

struct Resection {
  LensVector lens;  ///< without distortion
  RigidTransform device_from_points;
};

/// Lens and place of a projector from points that do not all lie on one plane: the direct linear transformation,
/// reweighted so that outliers count little.
/// @errors kImpossible: too few points, all on one plane, or a mirrored picture
/// @thread reentrant
[[nodiscard]] Result<Resection> resect(std::span<const SpacePoint> points);

}  // namespace slsd
