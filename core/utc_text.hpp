// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <string>

namespace slsd {

/// "2026-01-31T12:00:00Z": ISO 8601, UTC, in whole seconds. @thread reentrant
[[nodiscard]] std::string utc_text(std::chrono::system_clock::time_point time);
/// The same with milliseconds: "2026-01-31T12:00:00.250Z". @thread reentrant
[[nodiscard]] std::string utc_text_ms(std::chrono::system_clock::time_point time);

}  // namespace slsd
