// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <limits>
#include <span>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/geometry/pixel_ray.hpp"

namespace slsd {

/// Segment of the epipolar line in which the projector may see a camera pixel's point, within the working depth. In
/// undistorted, normalised projector coordinates it is exactly straight. Distances are in projector px, scaled by the
/// focal lengths (not by the distortion's local magnification, a few percent at the border).
///
///     depth_max ───┬──────────●───────┬─── depth_min     residual_px: signed distance of ● from the line
///                  far end          near end              along_px: place on the line
class EpipolarSegment {
 public:
  /// Signed distance from the line, projector px.
  [[nodiscard]] double residual_px(const Eigen::Vector2d& projector_direction) const {
    return line_.dot(projector_direction) + line_offset_px_;
  }
  /// Position along the line, projector px.
  [[nodiscard]] double along_px(const Eigen::Vector2d& projector_direction) const {
    return axis_.dot(projector_direction);
  }
  /// Distance of a projector direction beyond the nearer end, along the line, projector px; negative between the ends.
  [[nodiscard]] double outside_px(const Eigen::Vector2d& projector_direction) const {
    const double along = along_px(projector_direction);
    return std::max(along_min_px_ - along, along - along_max_px_);
  }
  /// Tells whether a projector direction lies within tolerance_px of the segment's line, and between its ends.
  [[nodiscard]] bool passes(const Eigen::Vector2d& projector_direction, double tolerance_px) const {
    const double residual = residual_px(projector_direction);
    const double along = along_px(projector_direction);
    return (residual <= tolerance_px) & (residual >= -tolerance_px) & (along >= along_min_px_) &
           (along <= along_max_px_);
  }
  /// Tells whether no depth of the working range lies in front of the projector.
  [[nodiscard]] bool empty() const { return !(along_min_px_ <= along_max_px_); }

 private:
  friend class EpipolarGate;
  Eigen::Vector2d line_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis_ = Eigen::Vector2d::Zero();
  double line_offset_px_ = std::numeric_limits<double>::infinity();
  double along_min_px_ = 1, along_max_px_ = -1;
};

/// Directions of up to PixelRays::kAtOnce pairs of rays, undistorted and normalised, one column for each component.
struct RayPairs {
  PixelRays::Column camera_x, camera_y, projector_x, projector_y;
};

/// Constants of a rig from which segments are computed.
struct EpipolarRig {
  RigidTransform projector_from_camera;
  Eigen::Matrix3d line_from_camera;  ///< the essential matrix
  Eigen::Array2d focal_px, per_focal_px;
  double depth_min_mm, depth_max_mm;
};

/// Makes the segment of any camera ray.
/// @thread reentrant
class EpipolarGate {
 public:
  /// @param depth_min_mm  working range along the camera's z axis, 0 < min < max
  EpipolarGate(const CalibratedCamera& camera, const Lens& projector, double depth_min_mm, double depth_max_mm);

  /// @param camera_direction  undistorted, normalised
  [[nodiscard]] EpipolarSegment prepare(const Eigen::Vector2d& camera_direction) const;
  /// The same for many rays.
  /// @param rays      only their directions are used
  /// @param segments  becomes one segment for each ray, up to its size
  void prepare(const PixelRays& rays, std::span<EpipolarSegment> segments) const;
  /// Compares as many pairs as the results have places; both results have the same size.
  /// @param residuals_px  prepare(camera's).residual_px(projector's)
  /// @param disparities   the baseline over the depth of the intersection, using the components along the epipolar line
  ///                      only. Times a focal length it is a disparity. 0 without such a line
  void compare(const RayPairs& rays, std::span<float> residuals_px, std::span<float> disparities) const;

 private:
  EpipolarRig rig_;
};

}  // namespace slsd
