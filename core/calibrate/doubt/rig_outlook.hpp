// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/calibrate/doubt/misreading.hpp"

namespace slsd {

/// Depths along the camera's z axis between which the rig shall measure, mm.
struct DepthRange {
  double min_mm, max_mm;

  [[nodiscard]] bool holds(double depth_mm) const { return depth_mm >= min_mm && depth_mm <= max_mm; }
  [[nodiscard]] double middle_mm() const;  ///< geometric mean
};

/// Expected performance of a rig, as calibrated, within a range of depths.
struct RigOutlook {
  double lit_share;       ///< share of each device's image that the other reaches, at the best depth
  double baseline_mm;     ///< between camera and projector, across the camera's line of sight
  double baseline_share;  ///< share of the depth at the middle of the range
  double parallax_px;     ///< shift from the nearest to the farthest depth, in the projector
  double sigma_mm;        ///< deviation of a depth at the middle of the range, for a tenth of a pixel

  /// Likelihood of such a rig, natural logarithm; 0: as likely as any other.
  [[nodiscard]] double log_likelihood() const;
};

/// @thread reentrant
[[nodiscard]] RigOutlook look_at_rig(const CameraRig& rig, const DepthRange& range);

/// Likelihood of a lens's parameters, natural logarithms; 0: as likely as any others.
struct LensLikelihood {
  double principal_point;
  double focal_length;
  double decentring;  ///< of the tangential distortion, which is small in every lens

  [[nodiscard]] double sum() const { return principal_point + focal_length + decentring; }
};
[[nodiscard]] LensLikelihood camera_likelihood(const Lens& lens);
/// A projector's lens may shift the image up or down.
[[nodiscard]] LensLikelihood projector_likelihood(const Lens& lens);

}  // namespace slsd
