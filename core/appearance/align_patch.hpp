// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/appearance/pattern_field.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/pixel_ray.hpp"
#include "core/image.hpp"

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

/// Pixels of the camera to align.
struct PatchWindow {
  int left, top, width, height;
  /// Square of the pattern that counts: centre and half side, in projector px along both axes.
  Eigen::Vector2f square_middle_px = Eigen::Vector2f::Zero();
  float square_half_px = 1e6F;
};

struct AlignOptions {
  float across_sigma_px = 0.15F;  ///< deviation of the pattern from the epipolar lines; 0: none
  /// Standard deviation of the gain's change for one camera px, as a share of the gain; 0: no prior. Small windows need
  /// it, because light that fades within them resembles a displacement.
  float gain_slope_sigma = 0;
  int steps = 4;
  /// Model error in a good fit, as a share of the gain.
  float misfit_share = 0.02F;
  /// Standard deviations of noise and misfit at which a pixel counts half: the surface may end there or carry print.
  float outlier_sigmas = 4;
};

/// The fitted parameters, in this order: disparity, its slopes, across; gain, its slopes, offset.
inline constexpr int kFitted = 8;

struct PatchFit {
  PatchState state;
  float residual = 0;  ///< root mean square, grey levels
  float pixels = 0;    ///< number of pixels
  float support = 0;   ///< share of the pixels that agree with the pattern
  float scatter = 0;   ///< scatter of the patch's ninths about the plane, px, beyond the share of noise
  /// Covariance of disparity, its slopes and across, for a noise of one grey level in each pixel.
  Eigen::Matrix4f covariance = Eigen::Matrix4f::Zero();
  bool solved = false;  ///< the pattern is visible and determines the place
};

/// Aligns a window of the frame with the pattern by least squares of
///
///     I(x, y) = (gain + gain_x x + gain_y y) P(p(x, y)) + offset
///
/// with P the blurred pattern, by Gauss and Newton (Lucas and Kanade 1981; Baker and Matthews 2004). Gain, its slopes
/// and offset are linear, so each step solves for them anew without an initial estimate.
/// @thread thread-bound: keeps its buffers
class PatchAligner {
 public:
  explicit PatchAligner(AlignOptions options) : options_(options) {}

  /// @param full   the level of a saturated pixel, which does not count
  /// @param noise  one standard deviation of a pixel, grey levels: weighs the pixels against the prior of `across`
  /// @param start  within about a pixel of the truth
  template <class T>
  [[nodiscard]] PatchFit align(const ImageView<T>& frame, double full, float noise, const PatternField& field,
                               const PatchMap& map, const PatchWindow& window, const PatchState& start);

 private:
  AlignOptions options_;
  std::vector<float> patch_;
};

/// Sums over a patch for the normal equations.
struct PatchSums {
  Eigen::Matrix<double, kFitted, kFitted> normal;
  Eigen::Matrix<double, kFitted, 1> right;
  double squares, pixels;
};

/// The camera pixel, relative to the window's centre, that sees a projector pixel (relative to the map's origin) on the
/// patch.
[[nodiscard]] Eigen::Vector2f camera_offset(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& pixel);
/// The inverse: the projector pixel, relative to the map's origin, that lights the point at a camera pixel.
/// @param offset  the camera pixel relative to the window's centre
[[nodiscard]] Eigen::Vector2f projector_offset(const PatchMap& map, const PatchState& state,
                                               const Eigen::Vector2f& offset);

}  // namespace slsd
