// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// The meaning of an errno value, and the user's remedy.
struct SystemErrorMeaning {
  int number;
  ErrorCode code;
  std::string_view remedy;  ///< "check the path"
};

/// The error of a failed system call: "cannot read: No such file or directory; check the path".
/// @param number  errno
/// @param doing   the failed action, such as "cannot read"
/// @param where   the path, device or address
/// @param known   meanings that override the general table; the number 0 covers all numbers in neither
/// @thread        reentrant
[[nodiscard]] Error system_error(int number, std::string_view doing, std::string where = {},
                                 std::span<const SystemErrorMeaning> known = {});

/// The same as the failed state of any Result.
[[nodiscard]] inline tl::unexpected<Error> fail_system(int number, std::string_view doing, std::string where = {},
                                                       std::span<const SystemErrorMeaning> known = {}) {
  return tl::unexpected<Error>(system_error(number, doing, std::move(where), known));
}

}  // namespace slsd
