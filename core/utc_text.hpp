// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace slsd {

/// "2026-01-31T12:00:00Z": ISO 8601 in UTC, whatever the machine's time zone. @thread reentrant
[[nodiscard]] std::string utc_text(std::chrono::system_clock::time_point time);
/// The same with milliseconds: "2026-01-31T12:00:00.250Z". @thread reentrant
[[nodiscard]] std::string utc_text_ms(std::chrono::system_clock::time_point time);

/// Reads the output of the functions above, with up to nine decimals.
/// @return empty if the text is no such time: no Z, another zone, a day that does not exist
/// @thread reentrant
[[nodiscard]] std::optional<std::chrono::system_clock::time_point> time_from_utc(std::string_view text);

}  // namespace slsd
