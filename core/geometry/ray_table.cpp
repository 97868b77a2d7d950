// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/ray_table.hpp"

#include <algorithm>

namespace slsd {
namespace {

// 64 px keep the table of a 1600x1200 image in 8 kB, and its error so small that the second step ends at rounding.
constexpr int kPitchPx = 64;

int nodes_across(int size_px) {
  return (size_px - 1) / kPitchPx + 2;
}

double nodes_per_px(int size_px) {
  return (nodes_across(size_px) - 1) / std::max(size_px - 1.0, 1.0);
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
}

Eigen::Vector2d RayTable::estimate(const Eigen::Vector2d& pixel) const {
  const double x = std::clamp(pixel.x() * nodes_per_px_.x(), 0.0, columns_ - 1.001);
  const double y = std::clamp(pixel.y() * nodes_per_px_.y(), 0.0, rows_ - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const Eigen::Vector2d* node = &nodes_[static_cast<std::size_t>(row) * columns_ + column];
  const double right = x - column, below = y - row;
  return (1 - below) * ((1 - right) * node[0] + right * node[1]) +
         below * ((1 - right) * node[columns_] + right * node[columns_ + 1]);
}

PixelRay RayTable::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d near = lens_.refine(estimate(pixel), pixel);
  const Eigen::Matrix2d turn = lens_.distort_jacobian(near).inverse();
  return {near - turn * (lens_.distort(near) - pixel), turn};
}

}  // namespace slsd
