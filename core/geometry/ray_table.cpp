// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/ray_table.hpp"

#include <algorithm>

#include "core/clones.hpp"

namespace slsd {
namespace {

// 64 px keep the table of a 1600x1200 image at 8 kB, and one step is enough for ordinary lenses.
constexpr int kPitchPx = 64;
constexpr double kErrorMax = 1e-10;

int nodes_across(int size_px) {
  return (size_px - 1) / kPitchPx + 2;
}

double nodes_per_px(int size_px) {
  return (nodes_across(size_px) - 1) / std::max(size_px - 1.0, 1.0);
}

/// A direction, and its derivative with respect to the pixel.
struct Turning {
  double x, y, xx, xy, yx, yy;
};

/// A step of Newton's method from a direction near that of the pixel.
inline __attribute__((always_inline)) Turning refined(const Lens& lens, double x, double y, double u, double v) {
  Lens::View<double> seen;
  lens.view(x, y, seen);
  const double per_area = 1 / (seen.u_x * seen.v_y - seen.u_y * seen.v_x);
  const double xx = seen.v_y * per_area, xy = -seen.u_y * per_area, yx = -seen.v_x * per_area, yy = seen.u_x * per_area;
  const double off_u = seen.u - u, off_v = seen.v - v;
  return {x - (xx * off_u + xy * off_v), y - (yx * off_u + yy * off_v), xx, xy, yx, yy};
}

inline __attribute__((always_inline)) void refine_all(const Lens& of, PixelRays& rays, std::size_t count) {
  const Lens lens = of;
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const Turning to = refined(lens, rays.x[i], rays.y[i], rays.u[i], rays.v[i]);
    rays.x[i] = to.x, rays.y[i] = to.y;
    rays.xx[i] = to.xx, rays.xy[i] = to.xy, rays.yx[i] = to.yx, rays.yy[i] = to.yy;
  }
}

}  // namespace

RayTable::RayTable(const Lens& lens)
    : lens_(lens),
      columns_(nodes_across(lens.width_px)),
      rows_(nodes_across(lens.height_px)),
      nodes_per_px_(nodes_per_px(lens.width_px), nodes_per_px(lens.height_px)) {
  nodes_.reserve(static_cast<std::size_t>(columns_) * rows_);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      nodes_.push_back(lens.undistort((Eigen::Array2d(column, row) / nodes_per_px_).matrix()));
    }
  }
  refines_ = error_between_nodes() > kErrorMax;
}

/// Error of one step at the places farthest from the nodes, where the estimate is worst.
double RayTable::error_between_nodes() const {
  double error = 0;
  for (int row = 0; row + 1 < rows_; ++row) {
    for (int column = 0; column + 1 < columns_; ++column) {
      const Eigen::Vector2d pixel = (Eigen::Array2d(column + 0.5, row + 0.5) / nodes_per_px_).matrix();
      error = std::max(error, (ray(pixel).direction - lens_.undistort(pixel)).norm());
    }
  }
  return error;
}

Eigen::Vector2d RayTable::estimate(double u, double v) const {
  const double x = u * nodes_per_px_.x(), y = v * nodes_per_px_.y();
  const int column = static_cast<int>(std::clamp(x, 0.0, columns_ - 2.0));
  const int row = static_cast<int>(std::clamp(y, 0.0, rows_ - 2.0));
  const Eigen::Vector2d* node = &nodes_[static_cast<std::size_t>(row) * columns_ + column];
  const double right = x - column, below = y - row;
  return (1 - below) * ((1 - right) * node[0] + right * node[1]) +
         below * ((1 - right) * node[columns_] + right * node[columns_ + 1]);
}

PixelRay RayTable::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d near = estimate(pixel.x(), pixel.y());
  Turning to = refined(lens_, near.x(), near.y(), pixel.x(), pixel.y());
  if (refines_) to = refined(lens_, to.x, to.y, pixel.x(), pixel.y());
  Eigen::Matrix2d turn;
  turn << to.xx, to.xy, to.yx, to.yy;
  return {{to.x, to.y}, turn};
}

void RayTable::look_up(PixelRays& rays, std::size_t count) const {
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d near = estimate(rays.u[i], rays.v[i]);
    rays.x[i] = near.x(), rays.y[i] = near.y();
  }
  if (refines_) Cloned<refine_all>::call(lens_, rays, count);
  Cloned<refine_all>::call(lens_, rays, count);
}

}  // namespace slsd
