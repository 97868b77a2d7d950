// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <new>
#include <utility>

#include "core/result.hpp"

namespace slsd {

/// The error of a request for which the memory does not suffice.
[[nodiscard]] inline Error out_of_memory() {
  return {ErrorCode::kNoSpace,
          "no memory is left for this request: ask for less, such as a box or symbols, or raise the service's limit",
          {}};
}

/// Runs the work of a request. If memory runs out, frees what the work held, then runs `otherwise`, so that the request
/// fails and the service goes on.
/// @thread reentrant
template <class Work, class Otherwise>
void within_memory(Work&& work, Otherwise&& otherwise) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
  }
  std::forward<Otherwise>(otherwise)();
}

}  // namespace slsd
