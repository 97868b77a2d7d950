// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

#include "core/decode/rules.hpp"
#include "core/result.hpp"
#include "tests/adversary/report_table.hpp"

namespace slsd::adversary {

/// @errors kNotFound: no rule of the name, or the decoder cannot do without it
[[nodiscard]] Result<DecodeRule> rule_named(std::string_view name);

/// Decodes frames once with all rules, then once more without each rule that was met there, and prints for each rule
/// what it saves and what it costs.
/// @param off  left out throughout: two rules that save the same save nothing one by one
/// @return     wrong points with all others
/// @errors as Misled::of() and Decoder::decode()
[[nodiscard]] Result<int> sweep_rules(const ReportOptions& options, const RuleSet& off);

}  // namespace slsd::adversary
