// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/shape_features.hpp"

#include <cstddef>

#include "core/clones.hpp"

namespace slsd {
namespace {

/// A direction in the image, per unit of change.
template <class Number>
struct Along {
  Number x, y;
};

/// Contracts a symmetric tensor over the plane, stored by its number of y indices, with a direction: one index less.
template <class Number, std::size_t kSize>
struct Tensor {
  Number of[kSize];

  __attribute__((always_inline)) Tensor<Number, kSize - 1> along(const Along<Number>& direction) const {
    Tensor<Number, kSize - 1> taken;
    for (std::size_t i = 0; i + 1 < kSize; ++i) taken.of[i] = direction.x * of[i] + direction.y * of[i + 1];
    return taken;
  }
};

/// @param moments  weight, m20, m11, m02, m30, m21, m12, m03
/// @param u, v     in the image, for one unit of the symbol's size
template <class Number>
inline __attribute__((always_inline)) void find(const Number (&moments)[kFeatureCount], const Along<Number>& u,
                                                const Along<Number>& v, Number (&features)[kFeatureCount]) {
  const auto& [weight, m20, m11, m02, m30, m21, m12, m03] = moments;
  const Tensor<Number, 3> second{{m20, m11, m02}};
  const Tensor<Number, 4> third{{m30, m21, m12, m03}};
  const auto square_u = second.along(u), square_v = second.along(v);
  const auto cube_u = third.along(u), cube_v = third.along(v);
  const auto cube_uu = cube_u.along(u), cube_uv = cube_u.along(v), cube_vv = cube_v.along(v);
  const Number area = u.x * v.y - u.y * v.x;
  features[0] = weight * (area < 0 ? -area : area);
  features[1] = square_u.along(u).of[0], features[2] = square_u.along(v).of[0], features[3] = square_v.along(v).of[0];
  features[4] = cube_uu.along(u).of[0], features[5] = cube_uu.along(v).of[0], features[6] = cube_uv.along(v).of[0],
  features[7] = cube_vv.along(v).of[0];
}

inline __attribute__((always_inline)) void find_eight(const EightMoments& moments, float per_size,
                                                      EightShapes& shapes) {
  const auto& [ux, uy, vx, vy] = moments.map;
  find<Lanes>(moments.of, {ux * per_size, uy * per_size}, {vx * per_size, vy * per_size}, shapes.of);
}

}  // namespace

ShapeFeatures shape_features(const GreyMoments& g, const Eigen::Matrix2f& pattern_from_camera, float symbol_size_px) {
  const Eigen::Matrix2f map = pattern_from_camera / symbol_size_px;
  float features[kFeatureCount];
  find<float>({g.weight, g.m20, g.m11, g.m02, g.m30, g.m21, g.m12, g.m03}, {map(0, 0), map(0, 1)},
              {map(1, 0), map(1, 1)}, features);
  return Eigen::Map<const ShapeFeatures>(features);
}

void EightMoments::set(int lane, const GreyMoments& g, const Eigen::Matrix2f& pattern_from_camera) {
  of[0][lane] = g.weight;
  of[1][lane] = g.m20, of[2][lane] = g.m11, of[3][lane] = g.m02;
  of[4][lane] = g.m30, of[5][lane] = g.m21, of[6][lane] = g.m12, of[7][lane] = g.m03;
  map[0][lane] = pattern_from_camera(0, 0), map[1][lane] = pattern_from_camera(0, 1);
  map[2][lane] = pattern_from_camera(1, 0), map[3][lane] = pattern_from_camera(1, 1);
}

void find_features(const EightMoments& moments, float symbol_size_px, EightShapes& shapes) {
  Cloned<find_eight>::call(moments, 1 / symbol_size_px, shapes);
}

}  // namespace slsd
