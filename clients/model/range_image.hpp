// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/read_dense_ply.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd::model {

using Box = Eigen::AlignedBox3f;

/// Measurement of one camera in one frame, cropped to the measured pixels.
struct RangeImage {
  std::size_t camera = 0;  ///< in the calibration's order
  Lens lens;
  RigidTransform camera_from_rig;
  Lens projector;  ///< whose light ends where its image ends
  RigidTransform projector_from_rig;
  std::optional<Box> box;                        ///< in the rig's frame, mm; points outside were left out
  int left = 0, top = 0, width = 0, height = 0;  ///< the crop, px of the camera
  std::vector<float> depth_mm;                   ///< along the camera's z axis, row by row; NaN where not measured
  std::vector<float> sigma_mm;                   ///< along the ray
  std::vector<std::uint8_t> intensity;
  std::vector<Rgb> colours;  ///< empty: the cloud has none

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  /// Crops to the pixels that are measured; to none if there is none.
  void trim();
  /// Keeps only what the camera is.
  void drop_pixels() { depth_mm = {}, sigma_mm = {}, intensity = {}, colours = {}; }
  /// Pixel of the crop, unrounded, that sees a point of the camera's frame with z > 0.
  [[nodiscard]] Eigen::Vector2f pixel_of(const Eigen::Vector3f& in_camera) const {
    const double depth = in_camera.z();
    Lens::View<double> seen;
    lens.view(in_camera.x() / depth, in_camera.y() / depth, seen);
    return {static_cast<float>(seen.u - left), static_cast<float>(seen.v - top)};
  }
};

/// The nearest colour of 8 bits to a mean of some.
[[nodiscard]] inline Rgb to_rgb(const Eigen::Vector3f& mean) {
  Rgb colour;
  for (int i = 0; i < 3; ++i) colour[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(mean[i]));
  return colour;
}

/// Puts the points of a dense cloud back into their pixels: a point lies on the ray through its pixel's centre.
/// @param box  in the rig's frame, mm; points outside are left out; nothing: all are taken
/// @return     an image for each camera that measured something, in the calibration's order
/// @errors kMismatch: the cloud is not of this calibration
/// @thread reentrant
[[nodiscard]] Result<std::vector<RangeImage>> range_images(std::span<const DensePoint> points,
                                                           const Calibration& calibration,
                                                           const std::optional<Box>& box);

}  // namespace slsd::model
