// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/start_calibrating.hpp"

#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "drivers/system/own_program.hpp"

namespace slsd {

Result<> start_calibrating(char** argv) {
  const auto program = find_own_program(kCalibrator);
  ::execv(program.c_str(), argv);
  if (errno != ENOENT && errno != ENOTDIR)
    return fail(ErrorCode::kIo, "does not start: " + std::generic_category().message(errno), program.string());
  return fail(
      ErrorCode::kNotFound,
      "the program that calibrates, verifies and prints boards is not installed: install the package slsd-calibrate",
      program.string());
}

}  // namespace slsd
