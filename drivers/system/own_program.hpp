// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// Finds one of slsd's programs: beside this one, as in a build tree; else in the install folder.
/// @thread reentrant
[[nodiscard]] std::filesystem::path find_own_program(const std::string& name);

/// The descriptors that a child starts with; it gets no others. -1 is /dev/null.
struct ChildStreams {
  int in = -1;
  int out = -1;
  int errors = -1;
};

/// Starts the program with no signal ignored or blocked. The caller must wait for its end.
/// @errors kNotFound if there is no such program, kIo
/// @thread reentrant
[[nodiscard]] Result<pid_t> start_own_program(const std::filesystem::path& program,
                                              const std::vector<std::string>& arguments, const ChildStreams& streams);

}  // namespace slsd
