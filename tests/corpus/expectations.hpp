// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

namespace slsd {

/// What the decoder's defaults have to reach on a scene; no point may ever be wrong.
struct Expectation {
  std::string_view scene;      ///< folder of tests/corpus, or pattern that is its own frame
  double decoded_min_percent;  ///< of the resolvable symbols
  double inlier_min_percent;   ///< of the same, those whose depth is no outlier
  double depth_rms_max_mm;
};

/// Folders of tests/corpus.
inline constexpr Expectation kRendered[] = {{"16px-5-plane_0", 99.8, 99.8, 0.11},
                                            {"16px-5-plane_30", 99.8, 99.8, 0.11},
                                            {"16px-5-cylinder", 95.2, 91.6, 0.34},
                                            {"16px-5-bust", 97.3, 97, 0.3},
                                            {"16px-5-step", 89.7, 85.5, 0.22},
                                            {"16px-5-textured", 43, 38.4, 1.08},
                                            {"16px-5-falling_light", 91.3, 89.6, 0.31},
                                            {"8px-6-plane_0", 99.8, 99.8, 0.12},
                                            {"8px-6-cylinder", 97.6, 95.7, 0.32},
                                            {"8px-6-bust", 88.7, 87.2, 0.4},
                                            {"8px-6-bust-near", 95.8, 95.3, 0.14},
                                            {"8px-6-dense-bust-webcam", 79, 79, 0.82},
                                            {"8px-6-dense-bust-window", 65.5, 65.5, 1.22},
                                            {"8px-6-dense-step-bright", 18, 17.8, 0.75},
                                            {"paper-1-plane_0", 98.5, 98.5, 0.12},
                                            {"paper-1-cylinder", 94.9, 90.6, 0.78},
                                            {"paper-1-bust", 79.3, 78.8, 0.45},
                                            {"paper-2-plane_0", 98.5, 98.5, 0.14},
                                            {"paper-2-cylinder", 95.8, 91.6, 0.75},
                                            {"paper-2-bust", 79.5, 78.4, 0.49}};

/// Patterns that are their own frames.
inline constexpr Expectation kPatterns[] = {{"16px-5", 100, 100, 0.06},
                                            {"8px-6", 99.7, 99.7, 0.15},
                                            {"paper-1", 99.7, 67.6, 0.88},
                                            {"paper-2", 99.7, 99.7, 0.26}};

}  // namespace slsd
