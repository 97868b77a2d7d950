// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/cloud/byte_sink.hpp"
#include "core/cloud/shade_points.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/ray_grid.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// One camera's measurement, and the transform of its pixels to the rig.
struct DenseView {
  DenseMap map;
  std::shared_ptr<const RayGrid> rays;  ///< shared by all frames
  RigidTransform rig_from_camera;
  std::uint8_t camera = 0;  ///< index in the calibration
  std::string camera_name;
  float epipolar_px = 0;          ///< distance of the frame's pattern from its epipolar lines, projector px
  std::vector<Rgb> colours = {};  ///< by pixel; empty: not wanted
  double white_differs = 0;  ///< share of the points at which the white frame differs from what the pattern's frame
                             ///< predicts
};

/// A point for each measured camera pixel: clouds as in docs/formats.md.
struct DenseCloud {
  std::vector<DenseView> views;
  std::string scan_id;
  std::string time;         ///< ISO 8601, UTC; when the exposure began
  std::uint64_t frame = 0;  ///< sequence number of the first camera's frame

  [[nodiscard]] std::size_t points() const;
  [[nodiscard]] bool coloured() const;
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use
};

/// Gives measured pixels the intensity of the white frame, as shade_points() does for symbols, and their colour if it
/// is wanted. Also counts pixels at which white differs from what the pattern's frame predicts, because something moved
/// between the two.
/// @return number of pixels whose intensity or colour is saturated
std::size_t shade_view(DenseView& view, const SceneLight& light, bool coloured = false);

// Binary, little-endian; normals, which face the camera, add 12 bytes a point. Points are in the robot's base with
// base_from_rig, else in the rig's frame.

/// The measured points, row by row and camera by camera: 18 bytes each.
void write_dense_ply(const DenseCloud& cloud, bool normals, const RigidTransform* base_from_rig, ByteSink& sink);
/// Organised: a point for each pixel, NaN if not measured, with the cameras' images stacked vertically. 21 bytes each,
/// as intensity is a float: PCL's PointXYZI accepts nothing else.
void write_dense_pcd(const DenseCloud& cloud, bool normals, const RigidTransform* base_from_rig, ByteSink& sink);
/// Two pages of floats for each camera: Z in its frame, mm, and sigma_mm.
[[nodiscard]] std::string write_dense_tiff(const DenseCloud& cloud);

}  // namespace slsd
