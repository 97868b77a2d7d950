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
    {"16px-5-plane_0", 99.5, 99.5, 0.12},       {"16px-5-plane_30", 99.5, 99.5, 0.13},
    {"16px-5-cylinder", 97.5, 92.2, 0.66},      {"16px-5-bust", 97.9, 97.4, 0.36},
    {"16px-5-step", 86.1, 83.8, 0.26},          {"16px-5-textured", 26.8, 23.3, 0.85},
    {"16px-5-falling_light", 87.1, 84.6, 0.36}, {"8px-6-plane_0", 99.5, 99.5, 0.13},
    {"8px-6-cylinder", 97.4, 96.1, 0.28},       {"8px-6-bust", 88.9, 87.5, 0.5},
    {"paper-1-plane_0", 98.8, 98.8, 0.13},      {"paper-1-cylinder", 96.2, 91, 1.3},
    {"paper-1-bust", 81.7, 79.6, 0.7},          {"paper-2-plane_0", 98.8, 98.8, 0.15},
    {"paper-2-cylinder", 97.5, 92.5, 1.4},      {"paper-2-bust", 83.3, 80.5, 1.15}};

/// Patterns that are their own frames.
inline constexpr Expectation kPatterns[] = {{"16px-5", 100, 100, 0.05},
                                            {"8px-6", 99.8, 99.8, 0.17},
                                            {"paper-1", 99.8, 67.2, 0.83},
                                            {"paper-2", 99.8, 99.1, 0.31}};

}  // namespace slsd
