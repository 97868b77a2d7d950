// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <span>

#include <Eigen/Core>

#include "core/cloud/read_dense_ply.hpp"
#include "core/datasheet/fit_sphere.hpp"
#include "core/result.hpp"

namespace slsd {

/// Distances of points from the surface that was fitted to them. The farthest three in a thousand are left out, as
/// VDI/VDE 2634 part 2 allows.
struct Form {
  std::size_t points = 0;
  std::size_t left_out = 0;
  double range_mm = 0;          ///< from the lowest to the highest point
  double range_95_mm = 0;       ///< the shortest interval with 95 % of the points, as in ISO 10360-13
  double rms_mm = 0;            ///< root mean square distance
  double error_over_sigma = 0;  ///< robust: the median error along the ray over sigma, 1 for true sigmas

  friend bool operator==(const Form&, const Form&) = default;
};

/// A flat plate at one place.
struct PlateFigures {
  Form form;
  double distance_mm = 0, tilt_deg = 0, long_side_mm = 0;
};

/// A sphere at one place.
struct SphereFigures {
  Form form;
  Sphere sphere;
  double size_error_mm = 0;  ///< diameter of the fitted sphere minus the calibrated one
};

/// Two spheres on a bar at one place.
struct BarFigures {
  Sphere first, second;
  double spacing_error_mm = 0;  ///< distance between the fitted centres minus the calibrated one
};

/// Measures the largest plane among the points.
/// @errors kNotFound: there is none
/// @thread reentrant
[[nodiscard]] Result<PlateFigures> measure_plate(std::span<const DensePoint> points);

/// @param diameter_mm  as calibrated
/// @errors kNotFound: no sphere of that size is visible
/// @thread reentrant
[[nodiscard]] Result<SphereFigures> measure_sphere(std::span<const DensePoint> points, double diameter_mm);

/// @param spacing_mm  between the centres, as calibrated
/// @errors kNotFound: fewer than two spheres of that size are visible; kMismatch: they are not nearly that far apart
/// @thread reentrant
[[nodiscard]] Result<BarFigures> measure_bar(std::span<const DensePoint> points, double diameter_mm, double spacing_mm);

}  // namespace slsd
