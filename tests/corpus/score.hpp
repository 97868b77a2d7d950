// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/decode/options.hpp"
#include "tests/corpus/scene.hpp"

namespace slsd {

/// How well a scene was decoded.
struct Score {
  int resolvable = 0;             ///< cells whose symbols both devices see whole and large enough
  int decoded = 0;                ///< of these, those with a right point
  int inliers = 0;                ///< of these, those whose depth is no outlier (inlier_limit_mm())
  std::vector<CloudPoint> wrong;  ///< points whose cell the camera does not see at their pixel
  int measured = 0;               ///< right points on a smooth surface, by which the depth is judged
  double depth_rms_mm = 0;        ///< of their error along the camera's z axis
  double depth_bias_mm = 0;       ///< its mean
  double depth_worst_mm = 0;      ///< its greatest magnitude

  [[nodiscard]] double decoded_percent() const { return resolvable == 0 ? 0 : 100.0 * decoded / resolvable; }
  [[nodiscard]] double inlier_percent() const { return resolvable == 0 ? 0 : 100.0 * inliers / resolvable; }
};

/// How far a point's depth may be off the median error: five standard deviations, told from the median so that outliers
/// do not widen it, or 0.5 mm at 2 m, whichever is more.
[[nodiscard]] double inlier_limit_mm(double deviation_median_mm, double depth_median_mm);

/// Every stage as the paper has it.
[[nodiscard]] DecodeOptions papers_way();

/// Decodes a scene's frame and compares with what the renderer knows. @errors as Decoder::create() and decode()
[[nodiscard]] Result<Score> decode_and_score(const Scene& scene, const DecodeOptions& options);

/// Compares points of the scene's camera with the truth.
[[nodiscard]] Score score(const Scene& scene, const std::vector<CloudPoint>& points);

}  // namespace slsd
