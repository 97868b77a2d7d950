// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/geometry/pixel_ray.hpp"

namespace slsd {

/// Map from a small window of the camera to the pattern, for any plane there. Let (x, y) be camera px from the window's
/// centre. The ray there is (r + T (x, y), 1), and rho is the inverse of its depth. The projector sees the point in the
/// direction R (r + T (x, y), 1) + rho t. On a plane rho is linear in x and y, and so is this direction. With the
/// projector's lens linearised around the centre, its pixel is
///
///     p = (q0 / q2, q1 / q2),  q = (base + shift (disparity, its slopes)) (1, x, y)
///
/// The disparity is the inverse depth relative to the reference, in units that move p by one projector px at the
/// centre.
struct PatchMap {
  Eigen::Matrix3f base;                                          ///< columns for x, y and 1; at the reference depth
  Eigen::Vector3f shift;                                         ///< change of q by a disparity of 1
  Eigen::Vector2f middle_px;                                     ///< centre of the window in the camera
  Eigen::Vector2i origin_px;                                     ///< origin of p: floats are exact enough near it
  Eigen::Vector2f along;                                         ///< unit vector along which p moves with the disparity
  double reference_inverse_depth = 0, inverse_depth_per_px = 0;  ///< 1/mm
};

/// @param ray                 ray of the window's centre
/// @param reference_depth_mm  along the camera's z axis
[[nodiscard]] PatchMap make_patch_map(const PixelRay& ray, const Eigen::Vector2d& middle_px,
                                      const RigidTransform& projector_from_camera, const Lens& projector,
                                      double reference_depth_mm);

/// The part of the map that depends only on the pixel, for use at many depths: R (T, r), with T and r as columns.
[[nodiscard]] Eigen::Matrix3d turned_by(const PixelRay& ray, const RigidTransform& projector_from_camera);
/// @param translation  translation of projector_from_camera
[[nodiscard]] PatchMap make_patch_map(const Eigen::Matrix3d& turned, const Eigen::Vector2d& middle_px,
                                      const Eigen::Vector3d& translation, const Lens& projector,
                                      double reference_inverse_depth);

/// Offset of the pattern from its epipolar lines over the frame, projector px: the calibration's error, or a knock.
struct EpipolarOffset {
  Eigen::Vector2f middle_px = Eigen::Vector2f::Zero();  ///< middle of the frame
  float middle = 0, slope_x = 0, slope_y = 0;           ///< offset there, and its change for one camera px

  [[nodiscard]] float at(const Eigen::Vector2f& camera_px) const {
    return middle + slope_x * (camera_px.x() - middle_px.x()) + slope_y * (camera_px.y() - middle_px.y());
  }
};

/// Position of a patch of the surface, and the light on it.
struct PatchState {
  float disparity = 0;                          ///< projector px relative to the reference
  float slope_x = 0, slope_y = 0;               ///< its change for one camera px
  float across = 0;                             ///< offset of the pattern from its epipolar line, projector px
  float bend_xx = 0, bend_xy = 0, bend_yy = 0;  ///< second derivatives of the disparity: given, not fitted
  float gain = 0, gain_x = 0, gain_y = 0;  ///< grey levels for light 1 at the centre, and their change for one camera
                                           ///< px
  float offset = 0;                        ///< grey level of the dark pattern
};

/// The camera pixel, relative to the window's centre, that sees a projector pixel (relative to the map's origin) on the
/// patch.
[[nodiscard]] Eigen::Vector2f camera_offset(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& pixel);
/// The inverse: the projector pixel, relative to the map's origin, that lights the point at a camera pixel.
/// @param offset  the camera pixel relative to the window's centre
[[nodiscard]] Eigen::Vector2f projector_offset(const PatchMap& map, const PatchState& state,
                                               const Eigen::Vector2f& offset);

}  // namespace slsd
