// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/decode/grid/lattice_frame.hpp"
#include "core/decode/symbols/grey_moments.hpp"
#include "core/lanes.hpp"

namespace slsd {

inline constexpr int kFeatureCount = 8;

/// Area, second and third central moments of a symbol in units of its own size, as if seen frontally: (area, m20, m11,
/// m02, m30, m21, m12, m03). Moments of order k over the area scale with size^k.
using ShapeFeatures = Eigen::Matrix<float, kFeatureCount, 1>;

/// Transforms a region's moments from the camera's image to the pattern. Moments are tensors, so an affine map of the
/// image is a linear map of them, without resampling.
/// @param pattern_from_camera  projector pixels for one camera pixel, the inverse of the lattice frame
[[nodiscard]] ShapeFeatures shape_features(const GreyMoments& moments, const Eigen::Matrix2f& pattern_from_camera,
                                           float symbol_size_px);

/// The same for eight regions at once, one for each lane.
struct EightShapes {
  Lanes of[kFeatureCount]{};

  void set(int lane, const ShapeFeatures& features) {
    for (int i = 0; i < kFeatureCount; ++i) of[i][lane] = features[i];
  }
};
struct EightMoments {
  Lanes of[kFeatureCount]{};  // weight, m20, m11, m02, m30, m21, m12, m03
  Lanes map[4]{};             // projector px for a camera px: u by x, by y, v by x, by y

  void set(int lane, const GreyMoments& moments, const Eigen::Matrix2f& pattern_from_camera);
};
/// @thread reentrant
void find_features(const EightMoments& moments, float symbol_size_px, EightShapes& shapes);

}  // namespace slsd
