// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// Finds a program of slsd's own: beside this one, as it is built; else where it is installed, or will be.
/// @thread reentrant
[[nodiscard]] std::filesystem::path find_own_program(const std::string& name);

/// The descriptors that a child begins with; it has no other. -1 is /dev/null.
struct ChildStreams {
  int in = -1;
  int out = -1;
  int errors = -1;
};

/// Starts it with no signal ignored or held back. Who starts it waits for its end.
/// @errors kNotFound where there is no such program, kIo
/// @thread reentrant
[[nodiscard]] Result<pid_t> start_own_program(const std::filesystem::path& program,
                                              const std::vector<std::string>& arguments, const ChildStreams& streams);

}  // namespace slsd
