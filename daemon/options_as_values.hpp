// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace slsd {

/// `--pattern --help` lacks its value, and would write a picture of that name. Refused for all options of a program and
/// of its commands, which are told before.
inline void refuse_options_as_values(CLI::App& app) {
  const auto lacks_value = [&app](const std::string& value) {
    for (const CLI::App* at = &app; at != nullptr; at = at->get_parent())
      if (at->get_option_no_throw(value) != nullptr) return "a value is missing before " + value;
    return std::string();
  };
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_min() > 0) option->check(lacks_value);
  for (CLI::App* command : app.get_subcommands(nullptr)) refuse_options_as_values(*command);
}

}  // namespace slsd
