// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/shape_features.hpp"

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/LU>

namespace slsd {
namespace {

/// A symmetric tensor over the plane, by how many of its indices are y, taken along a direction: one index less.
template <std::size_t kSize>
std::array<float, kSize - 1> along(const Eigen::RowVector2f& direction, const std::array<float, kSize>& tensor) {
  std::array<float, kSize - 1> taken;
  for (std::size_t i = 0; i + 1 < kSize; ++i) taken[i] = direction.x() * tensor[i] + direction.y() * tensor[i + 1];
  return taken;
}

}  // namespace

ShapeFeatures shape_features(const GreyMoments& g, const Eigen::Matrix2f& pattern_from_camera, float symbol_size_px) {
  const Eigen::Matrix2f map = pattern_from_camera / symbol_size_px;
  const Eigen::RowVector2f u = map.row(0), v = map.row(1);
  const std::array second{g.m20, g.m11, g.m02};
  const std::array third{g.m30, g.m21, g.m12, g.m03};
  const auto square_u = along(u, second), square_v = along(v, second);
  const auto cube_u = along(u, third);
  const auto cube_uu = along(u, cube_u), cube_uv = along(v, cube_u), cube_vv = along(v, along(v, third));
  ShapeFeatures features;
  features << g.weight * std::abs(map.determinant()),                       //
      along(u, square_u)[0], along(v, square_u)[0], along(v, square_v)[0],  //
      along(u, cube_uu)[0], along(v, cube_uu)[0], along(v, cube_uv)[0], along(v, cube_vv)[0];
  return features;
}

}  // namespace slsd
