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
inline constexpr Expectation kRendered[] = {
    {"16px-5-plane_0", 99.8, 99.8, 0.11},       {"16px-5-plane_30", 99.8, 99.8, 0.11},
    {"16px-5-cylinder", 99.1, 94.4, 0.47},      {"16px-5-bust", 98.4, 97.8, 0.3},
    {"16px-5-step", 91.5, 86.9, 0.32},          {"16px-5-textured", 52.3, 45.5, 1.58},
    {"16px-5-falling_light", 91.9, 90.3, 0.28}, {"8px-6-plane_0", 99.8, 99.8, 0.12},
    {"8px-6-cylinder", 97.6, 95.7, 0.24},       {"8px-6-bust", 91.7, 89.4, 0.4},
    {"8px-6-bust-near", 97.1, 96.2, 0.14},      {"paper-1-plane_0", 99.5, 99.5, 0.12},
    {"paper-1-cylinder", 98.2, 93.4, 1.18},     {"paper-1-bust", 87, 84, 1.11},
    {"paper-2-plane_0", 99.5, 99.5, 0.14},      {"paper-2-cylinder", 99.2, 92.4, 1.44},
    {"paper-2-bust", 88.2, 83.8, 0.99}};

/// Patterns that are their own frames.
inline constexpr Expectation kPatterns[] = {{"16px-5", 100, 100, 0.06},
                                            {"8px-6", 99.7, 99.7, 0.15},
                                            {"paper-1", 99.7, 67.6, 0.88},
                                            {"paper-2", 99.7, 99.7, 0.26}};

}  // namespace slsd
