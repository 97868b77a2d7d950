// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace slsd {

/// A word of the user's as a message quotes it: printable, in quotation marks.
[[nodiscard]] std::string quoted(const std::string& word);

/// A value that is one of these words. A misspelt one is answered with the nearest.
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> words);

/// A number from `least` to `most`, both included.
[[nodiscard]] CLI::Validator between(double least, double most);

/// Parses the command line of a program. Prints help or version; or, on standard error, one sentence that says what is
/// wrong with the usage: a misspelt command or option with the nearest one, a program without its command with the list
/// of all. An option is never taken for another option's value: `--pattern --help` would write a picture of that name.
/// @param app    has the program's name
/// @param check  what is left to check once all is parsed; throws CLI::ParseError
/// @return  nothing if the program is to run, else the status to exit with: 0, or 2 for wrong usage
[[nodiscard]] std::optional<int> parse_usage(CLI::App& app, int argc, const char* const* argv,
                                             const std::function<void()>& check = {});

}  // namespace slsd
