// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <toml++/toml.h>
#include <nlohmann/json.hpp>

namespace slsd {

/// The keys of a configuration as they were given, table by table. Dates and times, which no key has, become null.
/// @thread reentrant
[[nodiscard]] nlohmann::json given_keys(const toml::node& node);

}  // namespace slsd
