// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace slsd {

/// Quotes a user's word in a message: printable, in quotation marks.
[[nodiscard]] std::string quoted(const std::string& word);

/// Accepts one of these words. For a misspelt one, suggests the nearest.
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> words);

/// Accepts a number from `least` to `most`, both included.
[[nodiscard]] CLI::Validator between(double least, double most);

/// Parses the command line of a program. Call it first: standard streams that are closed get their numbers back. Prints
/// help or version, or one sentence on standard error about wrong usage. For a misspelt command or option it suggests
/// the nearest; for a missing command it lists all. An option is never taken as another option's value: `--pattern
/// --help` would write a picture of that name.
/// @param app    has the program's name
/// @param check  further checks after parsing; throws CLI::ParseError
/// @return  nothing if the program should run, else the exit status: 0, or 2 for wrong usage
[[nodiscard]] std::optional<int> parse_usage(CLI::App& app, int argc, const char* const* argv,
                                             const std::function<void()>& check = {});

}  // namespace slsd
