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
    {"16px-5-plane_0", 99.4, 99.4, 0.12},       {"16px-5-plane_30", 99.5, 99.5, 0.13},
    {"16px-5-cylinder", 98.4, 93.0, 0.62},      {"16px-5-bust", 97.4, 97.1, 0.34},
    {"16px-5-step", 89.4, 85.4, 0.3},           {"16px-5-textured", 50, 42, 2.1},
    {"16px-5-falling_light", 90.6, 88.6, 0.37}, {"8px-6-plane_0", 99.5, 99.5, 0.13},
    {"8px-6-cylinder", 97.2, 95.6, 0.3},        {"8px-6-bust", 89.8, 87.6, 0.54},
    {"paper-1-plane_0", 98.8, 98.8, 0.26},      {"paper-1-cylinder", 97.2, 91.6, 1.44},
    {"paper-1-bust", 85.7, 82.6, 0.9},          {"paper-2-plane_0", 98.8, 98.8, 0.29},
    {"paper-2-cylinder", 98.0, 92.4, 1.6},      {"paper-2-bust", 86, 82.1, 1.12}};

/// Patterns that are their own frames.
inline constexpr Expectation kPatterns[] = {{"16px-5", 100, 100, 0.06},
                                            {"8px-6", 99.7, 99.7, 0.15},
                                            {"paper-1", 99.7, 67.6, 0.88},
                                            {"paper-2", 99.7, 99.7, 0.26}};

}  // namespace slsd
