// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/code/arrays/hamming_profile.hpp"

namespace slsd {

struct NamedProfile {
  std::string name;
  HammingProfile profile;
};

/// The arrays whose profiles stand in docs/arrays.md and its chart.
[[nodiscard]] std::vector<NamedProfile> profiles_to_show();

/// The text of docs/arrays.md: the paper's tables 2, 3 and 4 and figure 3, the minimum distances reached, and
/// how soon runs of letters recur in the shipped patterns.
[[nodiscard]] std::string array_document(const std::vector<NamedProfile>& profiles);

}  // namespace slsd
