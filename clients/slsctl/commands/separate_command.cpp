// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/report.hpp"
#include "drivers/system/own_program.hpp"

namespace slsd {

int separate_command(const ClientOptions& options, const std::string& program_name, char** argv) {
  const auto program = find_own_program(program_name);
  ::execv(program.c_str(), argv);
  const bool missing = errno == ENOENT || errno == ENOTDIR;
  const Error error{missing ? ErrorCode::kNotFound : ErrorCode::kIo,
                    missing ? "the program that calibrates is not installed: install the package slsd-calibrate"
                            : "does not start: " + std::generic_category().message(errno),
                    program.string()};
  return report(options, {kRequestFailed, rpc_error(error)});
}

}  // namespace slsd
