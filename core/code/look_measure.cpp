// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/look_measure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>

namespace slsd {
namespace {

constexpr double kRampStart = 0.2;
constexpr double kRampEnd = 0.8;

int margin_px(const LookOptions& options) {
  return std::clamp(static_cast<int>(0.5 * options.spacing_px * options.camera_px_per_projector_px), 1, 2);
}

/// A pixel's place in its cell, in steps from one cell to the next: -0.5 to 0.5 within the cell.
Eigen::Vector2d place_in_cell(const Eigen::Matrix2d& cells_from_camera, const LookGeometry& geometry, int x, int y) {
  return cells_from_camera * (Eigen::Vector2d(x, y) - geometry.middle_px);
}

Eigen::Matrix2d cells_from_camera(const LookGeometry& geometry) {
  return geometry.camera_from_pattern.inverse() / (geometry.options.symbol_size_px + geometry.options.spacing_px);
}

/// Marks what is connected with a pixel through the eight neighbours.
void mark_region(const Image<double>& light, double level, int x, int y, Grey8& mask) {
  std::vector<std::pair<int, int>> open{{x, y}};
  while (!open.empty()) {
    const auto [px, py] = open.back();
    open.pop_back();
    if (!light.view().contains(px, py) || mask.at(px, py) != 0 || light.at(px, py) < level) continue;
    mask.at(px, py) = 1;
    for (int i = 0; i < 9; ++i) open.emplace_back(px + i % 3 - 1, py + i / 3 - 1);
  }
}

/// The region of the brightest pixel of the cell; empty where it is not the cell's only one or leaves the cell.
std::optional<Grey8> find_region(const Image<double>& light, const LookGeometry& geometry) {
  const Eigen::Matrix2d to_cells = cells_from_camera(geometry);
  const auto reach = [&](int x, int y) { return place_in_cell(to_cells, geometry, x, y).cwiseAbs().maxCoeff(); };
  int seed_x = 0, seed_y = 0;
  double brightest = -1;
  for (int y = 0; y < light.height(); ++y)
    for (int x = 0; x < light.width(); ++x)
      if (reach(x, y) < 0.4 && light.at(x, y) > brightest) brightest = light.at(seed_x = x, seed_y = y);
  Grey8 mask(light.width(), light.height());
  mark_region(light, geometry.threshold, seed_x, seed_y, mask);
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      const bool marked = mask.at(x, y) != 0;
      if (marked && reach(x, y) > 0.65) return std::nullopt;
      if (!marked && light.at(x, y) >= geometry.threshold && reach(x, y) < 0.42) return std::nullopt;
    }
  }
  return mask;
}

bool near_mask(const Grey8& mask, int x, int y, int margin) {
  for (int dy = -margin; dy <= margin; ++dy)
    for (int dx = -margin; dx <= margin; ++dx)
      if (mask.view().contains(x + dx, y + dy) && mask.at(x + dx, y + dy) != 0) return true;
  return false;
}

double peak_of(const Image<double>& light, const Grey8& mask) {
  double highest = 0, sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < light.size(); ++i)
    if (mask.data()[i] != 0) highest = std::max(highest, light.data()[i]);
  for (std::size_t i = 0; i < light.size(); ++i)
    if (mask.data()[i] != 0 && light.data()[i] >= 0.75 * highest) sum += light.data()[i], ++count;
  return sum / count;
}

struct WeightedPoint {
  Eigen::Vector2d at;
  double weight;
};

/// The pixels that count, in units of the symbol's side, by the grid vectors that are assumed.
std::vector<WeightedPoint> weigh(const Image<double>& light, const Grey8& mask, const LookGeometry& geometry) {
  const Eigen::Matrix2d map = geometry.assumed.inverse() / geometry.options.symbol_size_px;
  const double peak = peak_of(light, mask);
  std::vector<WeightedPoint> points;
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      const double ramp = (light.at(x, y) / peak - kRampStart) / (kRampEnd - kRampStart);
      if (ramp > 0 && near_mask(mask, x, y, margin_px(geometry.options)))
        points.push_back({map * (Eigen::Vector2d(x, y) - geometry.middle_px), std::min(ramp, 1.0)});
    }
  }
  return points;
}

LookFeatures moments_of(const std::vector<WeightedPoint>& points, double area_of_pixel) {
  double weight = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  for (const WeightedPoint& point : points) weight += point.weight, centroid += point.weight * point.at;
  centroid /= weight;
  LookFeatures sums = LookFeatures::Zero();
  for (const WeightedPoint& point : points) {
    const Eigen::Vector2d d = point.at - centroid;
    const double x = d.x(), y = d.y();
    sums.tail<7>() +=
        point.weight / weight *
        (Eigen::Matrix<double, 7, 1>() << x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y).finished();
  }
  sums(0) = weight * area_of_pixel;
  return sums;
}

}  // namespace

std::optional<LookFeatures> measure_look(const Image<double>& light, const LookGeometry& geometry) {
  const auto mask = find_region(light, geometry);
  if (!mask) return std::nullopt;
  const double side_px = geometry.options.symbol_size_px;
  const double area_of_pixel = 1 / std::abs(geometry.assumed.determinant()) / (side_px * side_px);
  return moments_of(weigh(light, *mask, geometry), area_of_pixel);
}

}  // namespace slsd
