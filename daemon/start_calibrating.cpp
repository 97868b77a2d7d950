// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/start_calibrating.hpp"

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

namespace slsd {
namespace {

constexpr const char* kProgram = "slsd-calibrate";

}  // namespace

std::filesystem::path find_calibrator() {
  std::error_code ignored;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  const auto beside = folder / kProgram;
  return std::filesystem::exists(beside, ignored) ? beside
                                                  : (folder / SLSD_LIBEXEC_FROM_BIN / kProgram).lexically_normal();
}

Result<> start_calibrating(char** argv) {
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return fail(ErrorCode::kIo, "cannot tell where slsd is: " + error.message(), "/proc/self/exe");
  const auto installed = (folder / SLSD_LIBEXEC_FROM_BIN / kProgram).lexically_normal();
  for (const auto& program : {folder / kProgram, installed}) {
    ::execv(program.c_str(), argv);
    if (errno != ENOENT && errno != ENOTDIR)
      return fail(ErrorCode::kIo, "does not start: " + std::generic_category().message(errno), program.string());
  }
  return fail(ErrorCode::kNotFound,
              "what calibrates, verifies and prints boards is not installed: install the package slsd-calibrate",
              installed.string());
}

}  // namespace slsd
