// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/surface_cells.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/dense/dense_map.hpp"

namespace slsd::model {
namespace {

/// Pixels around a cell that its plane is fitted to as well: normals of few pixels are noise.
constexpr int kMarginPx = 4;
/// Cosine below which a surface is too oblique for its place across the ray to be known.
constexpr float kSteepest = 0.15F;
/// Least cosine that a cell's sigma is reckoned with. Farther from the front, the surface's bend moves a cell more than
/// the error along the ray does.
constexpr double kLeastCosine = 0.5;

class CellFitter {
 public:
  explicit CellFitter(const RangeImage& image)
      : image_(image),
        rig_from_camera_(image.camera_from_rig.inverse()),
        rays_(image.depth_mm.size(), Eigen::Vector2f::Zero()) {
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if (!std::isnan(image.depth_mm[image.index(x, y)]))
          rays_[image.index(x, y)] = image.lens.undistort(Eigen::Vector2d(x + image.left, y + image.top)).cast<float>();
  }

  [[nodiscard]] CellGrid fit(int step) const {
    CellGrid grid{step, (image_.width + step - 1) / step, (image_.height + step - 1) / step, {}};
    grid.cells.resize(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
    for (int row = 0; row < grid.height; ++row)
      for (int column = 0; column < grid.width; ++column)
        grid.cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.width) +
                   static_cast<std::size_t>(column)] = fit_cell(column * step, row * step, step);
    return grid;
  }

 private:
  /// The measured pixel nearest to the cell's middle.
  [[nodiscard]] const float* seed(int left, int top, int step) const {
    const float* found = nullptr;
    int nearest = step * step;
    for (int y = top; y < std::min(top + step, image_.height); ++y) {
      for (int x = left; x < std::min(left + step, image_.width); ++x) {
        const float* depth = &image_.depth_mm[image_.index(x, y)];
        const int dx = 2 * (x - left) + 1 - step, dy = 2 * (y - top) + 1 - step;
        if (std::isnan(*depth) || dx * dx + dy * dy >= 4 * nearest) continue;
        nearest = (dx * dx + dy * dy) / 4, found = depth;
      }
    }
    return found;
  }

  // In a camera's frame a plane n X = d has 1/z = (n/d) (x/z, y/z, 1): linear in the ray.
  [[nodiscard]] SurfaceCell fit_cell(int left, int top, int step) const {
    const float* const from = seed(left, top, step);
    if (!from) return {};
    const float depth = *from;
    const int margin = std::min(kMarginPx, step);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    double sigma2 = 0, inverse_depth = 0;
    int own = 0, all = 0;
    const Eigen::Vector2f origin = rays_[static_cast<std::size_t>(from - image_.depth_mm.data())];
    for (int y = std::max(0, top - margin); y < std::min(top + step + margin, image_.height); ++y) {
      for (int x = std::max(0, left - margin); x < std::min(left + step + margin, image_.width); ++x) {
        const std::size_t pixel = image_.index(x, y);
        const int steps = std::max(std::abs(x - left - step / 2), std::abs(y - top - step / 2)) + 1;
        if (!(std::abs(image_.depth_mm[pixel] - depth) < kDepthJump * depth * static_cast<float>(std::min(steps, 4))))
          continue;
        const Eigen::Vector3d ray = (rays_[pixel] - origin).cast<double>().homogeneous();
        sum += ray * ray.transpose(), right += ray / image_.depth_mm[pixel];
        ++all;
        if (x < left || y < top || x >= left + step || y >= top + step) continue;
        middle += ray.head<2>(), inverse_depth += 1 / image_.depth_mm[pixel],
            sigma2 += image_.sigma_mm[pixel] * image_.sigma_mm[pixel];
        ++own;
      }
    }
    if (2 * own < step * step || all < 12) return {};
    const Eigen::Vector3d plane = sum.ldlt().solve(right);
    // The place is that of the cell's own pixels: where the surface bends, the plane of all lies beside it.
    middle /= own, inverse_depth /= own;
    const Eigen::Vector3d ray = (middle + origin.cast<double>()).homogeneous();
    const Eigen::Vector3d normal =
        -Eigen::Vector3d(plane.x(), plane.y(), plane.z() - plane.head<2>().dot(origin.cast<double>())).normalized();
    const double cosine = -normal.dot(ray.normalized());
    if (!(cosine > kSteepest)) return {};
    const Eigen::Vector3d place = rig_from_camera_ * Eigen::Vector3d(ray / inverse_depth);
    return {place.cast<float>(), (rig_from_camera_.rotation * normal).cast<float>(),
            static_cast<float>(std::sqrt(sigma2 / own) * std::max(cosine, kLeastCosine))};
  }

  const RangeImage& image_;
  RigidTransform rig_from_camera_;
  std::vector<Eigen::Vector2f> rays_;  // (x/z, y/z) of each measured pixel
};

}  // namespace

std::array<CellGrid, kCellSteps.size()> fit_cells(const RangeImage& image) {
  const CellFitter fitter(image);
  std::array<CellGrid, kCellSteps.size()> levels;
  for (std::size_t level = 0; level < kCellSteps.size(); ++level) levels[level] = fitter.fit(kCellSteps[level]);
  return levels;
}

}  // namespace slsd::model
