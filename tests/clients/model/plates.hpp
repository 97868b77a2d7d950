// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "bumpy_ball.hpp"

namespace slsd::model {

/// Distance to a block about the origin. @param half_mm  half its size
inline float block(const Eigen::Vector3f& at, const Eigen::Vector3f& half_mm) {
  const Eigen::Vector3f off = at.cwiseAbs() - half_mm;
  return off.cwiseMax(0).norm() + std::min(0.0F, off.maxCoeff());
}

inline const Eigen::Vector3f kPlateHalfMm(40, 30, 4);

inline float plate(const Eigen::Vector3f& at) {
  return block(at, kPlateHalfMm);
}

/// A foot, an upright wall at its back and a rib on it, as of a machined part of plates of 8 mm. y points down.
inline float bracket(const Eigen::Vector3f& at) {
  const float foot = block(at - Eigen::Vector3f(0, 26, 0), {45, 4, 32}),
              wall = block(at - Eigen::Vector3f(0, -5, 22), {45, 28, 4}),
              rib = block(at - Eigen::Vector3f(22, 0, 0), {4, 24, 28});
  return std::min({foot, wall, rib});
}

/// A scan that ends some pixels before each edge, as those of dense clouds.
inline std::vector<DensePoint> measure_eroded(const Distance& distance, const RigidTransform& rig_from_object,
                                              float sigma_mm, unsigned seed) {
  constexpr int kErodedPx = 3;
  constexpr float kJumpMm = 4;
  const Lens lens = test_calibration().cameras[0].lens;
  const std::vector<DensePoint> points = measure(distance, rig_from_object, sigma_mm, seed);
  const int width = lens.width_px, height = lens.height_px;
  std::vector<float> depth(static_cast<std::size_t>(width) * height, 0);
  std::vector<int> pixels;
  for (const DensePoint& point : points) {
    const Eigen::Vector2d pixel = lens.project(point.place_mm.cast<double>()).array().round();
    pixels.push_back(static_cast<int>(pixel.y()) * width + static_cast<int>(pixel.x()));
    depth[pixels.back()] = point.place_mm.z();
  }
  std::vector<DensePoint> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int column = pixels[i] % width, row = pixels[i] / width;
    const auto jumps = [&](int x, int y) {
      return x >= 0 && y >= 0 && x < width && y < height &&
             std::abs(depth[static_cast<std::size_t>(y) * width + x] - depth[pixels[i]]) > kJumpMm;
    };
    bool at_edge = false;
    for (int y = row - kErodedPx; y <= row + kErodedPx; ++y)
      for (int x = column - kErodedPx; x <= column + kErodedPx; ++x) at_edge = at_edge || jumps(x, y);
    if (!at_edge) kept.push_back(points[i]);
  }
  return kept;
}

inline Shot eroded_shot_of(const Distance& distance, const RigidTransform& rig_from_object, float sigma_mm,
                           unsigned seed, const std::optional<Box>& box = {},
                           const Calibration& calibration = test_calibration()) {
  return make_shot(*range_images(measure_eroded(distance, rig_from_object, sigma_mm, seed), calibration, box));
}

}  // namespace slsd::model
