// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "clients/slsctl/ask.hpp"
#include "clients/slsctl/client_options.hpp"

namespace slsd {

/// Reports an error, as text on standard error or, with --json, as an object on standard output.
/// @return the exit status
[[nodiscard]] int report(const ClientOptions& options, const Failure& failure);

/// The answer to `status` as a table for people.
[[nodiscard]] std::string status_table(const nlohmann::json& status);

/// The reasons why regions gave no point, one line for each rule. Empty if not requested.
[[nodiscard]] std::string reason_lines(const nlohmann::json& scan);

/// A scan in one line: "scan 1a2b3c4d-7: 2345 points of 2390 regions, capture 4.2 ms, decode 51.0 ms".
[[nodiscard]] std::string scan_line(const nlohmann::json& scan);

/// One line about why a scan, or the last one in status's `scans`, gave no points. Empty if it gave some.
[[nodiscard]] std::string empty_line(const nlohmann::json& scan);

}  // namespace slsd
