// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/code/pattern.hpp"

namespace slsd {

struct ShippedPattern {
  std::string name;  ///< of its file, without .toml
  PatternOptions options;
};

/// The patterns in config/patterns, all for 1280x800: the paper's two, and at each size one in which runs of letters
/// recur and the default, in which they do not.
[[nodiscard]] std::vector<ShippedPattern> shipped_patterns();

}  // namespace slsd
