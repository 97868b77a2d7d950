// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "docs/tables/configuration_table.hpp"

namespace slsd {

/// The text of config/slsd.toml: every key with its meaning. Cameras stand in comments.
[[nodiscard]] std::string configuration_file();

/// The text of man/slsd.toml.5.
[[nodiscard]] std::string configuration_page();

/// The meaning with the ranges of its keys in place of their names in braces.
[[nodiscard]] std::string meaning_of(const ConfigurationEntry& entry);

}  // namespace slsd
