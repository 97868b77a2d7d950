// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/cloud/paint_view.hpp"

#include <limits>
#include <vector>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr std::size_t kNodesMax = 3'000'000;

/// Places of a view's pixels in the rig's frame.
class PixelPlaces {
 public:
  explicit PixelPlaces(const DenseView& view)
      : view_(view),
        rotation_(view.rig_from_camera.rotation.cast<float>()),
        translation_(view.rig_from_camera.translation.cast<float>()) {}
  [[nodiscard]] std::size_t pixel(int x, int y) const { return static_cast<std::size_t>(y) * view_.map.width + x; }
  [[nodiscard]] bool measured(int x, int y) const { return view_.map.measured(pixel(x, y)); }
  [[nodiscard]] Eigen::Vector3f at(int x, int y) const {
    return rotation_ * (view_.map.depth_mm[pixel(x, y)] * view_.rays->at(x, y).homogeneous()) + translation_;
  }
  [[nodiscard]] const Eigen::Vector3f& camera() const { return translation_; }

 private:
  const DenseView& view_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
};

}  // namespace

MeasuredSurface surface_of(const DenseView& view) {
  const PixelPlaces places(view);
  int step = 1;
  while (view.map.pixels.size() / static_cast<std::size_t>(step * step) > kNodesMax) ++step;
  MeasuredSurface grid{(view.map.width + step - 1) / step, (view.map.height + step - 1) / step};
  grid.points_mm.assign(grid.index(0, grid.height), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x)
      if (places.measured(x * step, y * step)) grid.points_mm[grid.index(x, y)] = places.at(x * step, y * step);
  grid.seen_from_mm = places.camera();
  if (view.map.width > RayGrid::kPitchPx)
    grid.pitch = static_cast<float>(step) * (view.rays->at(RayGrid::kPitchPx, 0) - view.rays->at(0, 0)).norm() /
                 static_cast<float>(RayGrid::kPitchPx);
  return grid;
}

Unpainted paint_view(DenseView& view, std::span<const TextureView> textures, std::size_t surface, Executor& executor) {
  const PixelPlaces places(view);
  view.colours.assign(view.map.pixels.size(), Rgb{});
  std::vector<Unpainted> by_row(static_cast<std::size_t>(view.map.height));
  executor.run(view.map.height, [&](int y, int) {
    Unpainted& unpainted = by_row[static_cast<std::size_t>(y)];
    for (int x = 0; x < view.map.width; ++x) {
      if (!places.measured(x, y)) continue;
      const std::size_t pixel = places.pixel(x, y);
      const std::uint8_t painter =
          paint(places.at(x, y), view.map.sigma_mm[pixel], textures, surface, view.colours[pixel]);
      unpainted.unseen += painter == kUnseenByAll;
      unpainted.saturated += painter == kSaturatedInAll && view.map.intensity[pixel] < 255;
    }
  });
  Unpainted all;
  for (const Unpainted& row : by_row) all.unseen += row.unseen, all.saturated += row.saturated;
  return all;
}

}  // namespace slsd
