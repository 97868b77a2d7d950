// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/measured_box.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr int kSamples = 16;  // of a rectangle's side: a distorted side is bent

using Directions = Eigen::AlignedBox2d;  // x/z and y/z, undistorted

// The corners of the box between two planes of depth: those of the box itself, and of its edges on the planes.
Directions directions_of(const MeasuredBox& box, const CalibratedCamera& camera, double near_mm, double far_mm) {
  const RigidTransform camera_from_frame = box.frame_from_rig.after(camera.rig_from_camera).inverse();
  std::array<Eigen::Vector3d, 8> corners;
  for (int i = 0; i < 8; ++i) {
    corners[i] =
        camera_from_frame * Eigen::Vector3d((i & 1 ? box.most : box.least).x(), (i & 2 ? box.most : box.least).y(),
                                            (i & 4 ? box.most : box.least).z());
  }
  Directions seen;
  const auto see = [&](const Eigen::Vector3d& point) { seen.extend(Eigen::Vector2d(point.head<2>() / point.z())); };
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d& from = corners[i];
    if (from.z() >= near_mm && from.z() <= far_mm) see(from);
    for (const int axis : {1, 2, 4}) {
      const Eigen::Vector3d& to = corners[i ^ axis];
      if ((i & axis) != 0) continue;
      for (const double depth : {near_mm, far_mm}) {
        if ((from.z() < depth) == (to.z() < depth)) continue;
        see(from + (depth - from.z()) / (to.z() - from.z()) * (to - from));
      }
    }
  }
  return seen;
}

// Visits places along the border of a rectangle.
template <class Visit>
void along_border(const Eigen::Vector2d& least, const Eigen::Vector2d& most, const Visit& visit) {
  for (int i = 0; i <= kSamples; ++i) {
    const Eigen::Vector2d at = least + (most - least) * i / kSamples;
    visit(Eigen::Vector2d(at.x(), least.y())), visit(Eigen::Vector2d(at.x(), most.y()));
    visit(Eigen::Vector2d(least.x(), at.y())), visit(Eigen::Vector2d(most.x(), at.y()));
  }
}

// Beyond the frame a lens's distortion means nothing, so the box is cut to what the frame can see.
Directions directions_of_frame(const Lens& lens) {
  Directions seen;
  along_border({-0.5, -0.5}, {lens.width_px - 0.5, lens.height_px - 0.5},
               [&](const Eigen::Vector2d& px) { seen.extend(lens.undistort(px)); });
  return seen;
}

}  // namespace

PixelRectangle PixelRectangle::widened(int px, const Lens& lens) const {
  return {std::max(0, left - px), std::max(0, top - px), std::min(lens.width_px, right + px),
          std::min(lens.height_px, bottom + px)};
}

GreyView PixelRectangle::crop(const GreyView& image) const {
  return std::visit(
      [&](auto view) -> GreyView {
        view.pixels = view.row(top) + left;
        view.width = right - left, view.height = bottom - top;
        return view;
      },
      image);
}

Lens PixelRectangle::crop(const Lens& lens) const {
  Lens cropped = lens;
  cropped.width_px = right - left, cropped.height_px = bottom - top;
  cropped.cx -= left, cropped.cy -= top;
  return cropped;
}

std::optional<PixelRectangle> pixels_of_box(const MeasuredBox& box, const CalibratedCamera& camera, double depth_min_mm,
                                            double depth_max_mm) {
  const Directions seen =
      directions_of(box, camera, depth_min_mm, depth_max_mm).intersection(directions_of_frame(camera.lens));
  if (seen.isEmpty()) return std::nullopt;
  Eigen::AlignedBox2d pixels;
  along_border(seen.min(), seen.max(), [&](const Eigen::Vector2d& at) { pixels.extend(camera.lens.distort(at)); });
  const PixelRectangle found =
      PixelRectangle{static_cast<int>(std::floor(pixels.min().x())), static_cast<int>(std::floor(pixels.min().y())),
                     static_cast<int>(std::ceil(pixels.max().x())) + 1,
                     static_cast<int>(std::ceil(pixels.max().y())) + 1}
          .widened(0, camera.lens);
  if (found.empty()) return std::nullopt;
  return found;
}

}  // namespace slsd
