// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/shape_features.hpp"

#include <cmath>

namespace slsd {

ShapeFeatures shape_features(const GreyMoments& g, const Eigen::Matrix2f& pattern_from_camera, float symbol_size_px) {
  const Eigen::Matrix2f map = pattern_from_camera / symbol_size_px;
  const float a = map(0, 0), b = map(0, 1), c = map(1, 0), d = map(1, 1);
  const float third[4] = {g.m30, g.m21, g.m12, g.m03};
  // The cubic form along (p, q): sum over all index triples, by symmetry with binomial weights.
  const auto cubic = [&](float p0, float q0, float p1, float q1, float p2, float q2) {
    return p0 * p1 * p2 * third[0] + (p0 * p1 * q2 + p0 * q1 * p2 + q0 * p1 * p2) * third[1] +
           (p0 * q1 * q2 + q0 * p1 * q2 + q0 * q1 * p2) * third[2] + q0 * q1 * q2 * third[3];
  };
  ShapeFeatures features;
  features << g.weight * std::abs(a * d - b * c),               //
      a * a * g.m20 + 2 * a * b * g.m11 + b * b * g.m02,        //
      a * c * g.m20 + (a * d + b * c) * g.m11 + b * d * g.m02,  //
      c * c * g.m20 + 2 * c * d * g.m11 + d * d * g.m02,        //
      cubic(a, b, a, b, a, b), cubic(a, b, a, b, c, d), cubic(a, b, c, d, c, d), cubic(c, d, c, d, c, d);
  return features;
}

}  // namespace slsd
