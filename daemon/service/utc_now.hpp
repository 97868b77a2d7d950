// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

namespace slsd {

/// "2026-01-31T12:00:00Z".
[[nodiscard]] std::string utc_now();

}  // namespace slsd
