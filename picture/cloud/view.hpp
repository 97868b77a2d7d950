// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/cloud/cloud.hpp"

namespace slsd {

/// The box of space that a picture shows, mm, rig frame.
struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Ones();

  [[nodiscard]] bool contains(const Eigen::Vector3d& point) const {
    return (point.array() >= low.array()).all() && (point.array() <= high.array()).all();
  }
  [[nodiscard]] Eigen::Vector3d size() const { return high - low; }
};

/// The box around nearly all points (four in a thousand may lie outside). No side is thinner than a fifth of the
/// widest.
/// @param cloud  finite coordinates
[[nodiscard]] Box box_of(const Cloud& cloud);

/// An orthographic view from beside and above the scanner, with the whole box fitted into a rectangle of the picture.
/// Lengths across the view have one scale everywhere.
/// @thread reentrant
class View {
 public:
  struct Frame {
    double left_px, top_px, width_px, height_px;
  };
  View(const Box& box, const Frame& frame);

  /// The place in the picture (x right, y down, px), and the depth away from the viewer in the same scale.
  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector3d& point) const {
    return axes_ * point * px_per_mm_ + shift_;
  }
  [[nodiscard]] Eigen::Vector2d flat(const Eigen::Vector3d& point) const { return place(point).head<2>(); }
  /// The viewer's direction, rig frame.
  [[nodiscard]] Eigen::Vector3d forward() const { return axes_.row(2).transpose(); }
  [[nodiscard]] double px_per_mm() const { return px_per_mm_; }

 private:
  Eigen::Matrix3d axes_;  // rows: right, down, forward
  double px_per_mm_ = 1;
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();
};

}  // namespace slsd
