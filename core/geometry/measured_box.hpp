// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// The part of the scene to measure: a box along the axes of a frame, millimetres.
struct MeasuredBox {
  Eigen::Vector3d least, most;
  RigidTransform frame_from_rig = {};

  /// @param point  in the rig's frame
  [[nodiscard]] bool contains(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d place = frame_from_rig * point;
    return (place.array() >= least.array()).all() && (place.array() <= most.array()).all();
  }
};

/// A rectangle of pixels; right and bottom are one past the last.
struct PixelRectangle {
  int left = 0, top = 0, right = 0, bottom = 0;

  [[nodiscard]] bool empty() const { return left >= right || top >= bottom; }
  [[nodiscard]] bool contains(int x, int y) const { return x >= left && x < right && y >= top && y < bottom; }
  [[nodiscard]] bool meets(const PixelRectangle& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
  /// The same with more pixels on each side, within the frame.
  [[nodiscard]] PixelRectangle widened(int px, const Lens& lens) const;
  /// These pixels of an image that has them all.
  [[nodiscard]] GreyView crop(const GreyView& image) const;
  /// The same camera, of which only these pixels are read.
  [[nodiscard]] Lens crop(const Lens& lens) const;
  friend bool operator==(const PixelRectangle&, const PixelRectangle&) = default;
};

/// The pixels of a camera that can see a point of the box within the range of depths; empty if none can.
/// @param depth_min_mm  along the camera's axis, more than 0
/// @thread reentrant
[[nodiscard]] std::optional<PixelRectangle> pixels_of_box(const MeasuredBox& box, const CalibratedCamera& camera,
                                                          double depth_min_mm, double depth_max_mm);

}  // namespace slsd
