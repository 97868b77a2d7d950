// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/cloud/shade_points.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/ray_grid.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// One camera's measurement, and the place of its pixels in the rig.
struct DenseView {
  DenseMap map;
  std::shared_ptr<const RayGrid> rays;  ///< shared: the same for every frame
  RigidTransform rig_from_camera;
  std::uint8_t camera = 0;  ///< index in the calibration
  std::string camera_name;
  float epipolar_px = 0;     ///< distance of the frame's pattern from its epipolar lines, projector px
  double white_differs = 0;  ///< share of the points whose white frame is not as bright as the pattern's frame says
};

/// A point for each camera pixel that was measured: clouds as docs/formats.md says.
struct DenseCloud {
  std::vector<DenseView> views;
  std::string scan_id;
  std::string time;         ///< ISO 8601, UTC; when the exposure began
  std::uint64_t frame = 0;  ///< sequence number of the first camera's frame

  [[nodiscard]] std::size_t points() const;
  [[nodiscard]] std::size_t bytes() const;  ///< memory that it holds
};

/// Gives measured pixels the intensity of the white frame, as shade_points() does for symbols.
/// Counts also those where white is not what the pattern's frame lets expect: what moved between the two.
/// @return how many of them were saturated
std::size_t shade_view(DenseView& view, const SceneLight& light);

// Binary, little-endian; 12 bytes a point more with normals, which face the camera.

/// The measured points, row by row, one camera after the other: 18 bytes each.
[[nodiscard]] std::string write_dense_ply(const DenseCloud& cloud, bool normals);
/// Organised: a point for each pixel, NaN where nothing was measured; the cameras one below the other. 21 bytes each,
/// as intensity is a float: PCL's PointXYZI takes no other.
[[nodiscard]] std::string write_dense_pcd(const DenseCloud& cloud, bool normals);
/// Two pages of floats for each camera: Z in its own frame, mm, and sigma_mm.
[[nodiscard]] std::string write_dense_tiff(const DenseCloud& cloud);

}  // namespace slsd
