// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

namespace slsd::test {

/// How often operator new was called in this program so far, on all threads; 0 under the thread sanitizer.
[[nodiscard]] std::uint64_t allocations();

/// What they asked for, whether it has been given back or not.
[[nodiscard]] std::uint64_t allocated_bytes();

/// Of this process.
[[nodiscard]] double resident_mib();

}  // namespace slsd::test
