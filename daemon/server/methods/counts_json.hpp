// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

#include "daemon/scan/cloud/scan_result.hpp"

namespace slsd {

/// The counts of regions by status.
template <class Counts>
[[nodiscard]] nlohmann::json regions_json(const Counts& counts) {
  nlohmann::json regions = nlohmann::json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    regions[std::string(to_string(static_cast<RegionStatus>(i)))] = counts[i];
  }
  return regions;
}

/// The counts of the rules that decided on at least one region.
template <class Counts>
[[nodiscard]] nlohmann::json rules_json(const Counts& counts) {
  nlohmann::json rules = nlohmann::json::object();
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (counts[i] > 0) rules[std::string(to_string(decode_rule(i)))] = counts[i];
  return rules;
}

/// The name of a stage of decoding.
[[nodiscard]] inline std::string stage_name(std::size_t index) {
  return std::string(to_string(static_cast<Stage>(index)));
}

}  // namespace slsd
