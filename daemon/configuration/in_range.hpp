// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>

#include "core/result.hpp"

namespace slsd {

/// Whether an option's value lies in its range, both ends included.
/// @errors kInvalidArgument: "KEY must be LOW to HIGH, not VALUE"
/// @thread reentrant
[[nodiscard]] inline Result<> in_range(const char* key, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorCode::kInvalidArgument, std::string(key) + " must be " + std::to_string(low) + " to " +
                                               std::to_string(high) + ", not " + std::to_string(value));
}

}  // namespace slsd
