// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// The meaning of a number of errno, and the user's remedy.
struct SystemErrorMeaning {
  int number;
  ErrorCode code;
  std::string_view remedy;  ///< "check the path"
};

/// The error of a system call that failed: "cannot read: No such file or directory; check the path".
/// @param number  errno
/// @param doing   what was tried, as in "cannot read"
/// @param where   the path, device or address
/// @param known   what this place knows better than the table for all; the number 0 is for those that neither names
/// @thread        reentrant
[[nodiscard]] Error system_error(int number, std::string_view doing, std::string where = {},
                                 std::span<const SystemErrorMeaning> known = {});

/// The same as the failed state of any Result.
[[nodiscard]] inline tl::unexpected<Error> fail_system(int number, std::string_view doing, std::string where = {},
                                                       std::span<const SystemErrorMeaning> known = {}) {
  return tl::unexpected<Error>(system_error(number, doing, std::move(where), known));
}

}  // namespace slsd
