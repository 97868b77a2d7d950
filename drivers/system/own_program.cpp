// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/own_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <csignal>
#include <system_error>

namespace slsd {
namespace {

class SpawnSetting {
 public:
  explicit SpawnSetting(const ChildStreams& streams) {
    ::posix_spawn_file_actions_init(&actions_);
    put(streams.in, STDIN_FILENO, O_RDONLY);
    put(streams.out, STDOUT_FILENO, O_WRONLY);
    put(streams.errors, STDERR_FILENO, O_WRONLY);
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, STDERR_FILENO + 1);
    ::posix_spawnattr_init(&attributes_);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes_, &none);
    ::posix_spawnattr_setsigdefault(&attributes_, &all);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSetting() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }
  SpawnSetting(const SpawnSetting&) = delete;
  SpawnSetting& operator=(const SpawnSetting&) = delete;

  int spawn(pid_t& process, const std::filesystem::path& program, const std::vector<std::string>& arguments) {
    std::string name = program.string();
    std::vector<char*> pointers{name.data()};
    for (const std::string& argument : arguments) pointers.push_back(const_cast<char*>(argument.c_str()));
    pointers.push_back(nullptr);
    return ::posix_spawn(&process, program.c_str(), &actions_, &attributes_, pointers.data(), environ);
  }

 private:
  void put(int number, int as, int mode) {
    if (number < 0)
      ::posix_spawn_file_actions_addopen(&actions_, as, "/dev/null", mode, 0);
    else
      ::posix_spawn_file_actions_adddup2(&actions_, number, as);
  }

  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace

std::filesystem::path find_own_program(const std::string& name) {
  std::error_code ignored;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  const auto beside = folder / name;
  return std::filesystem::exists(beside, ignored) ? beside : (folder / SLSD_LIBEXEC_FROM_BIN / name).lexically_normal();
}

Result<pid_t> start_own_program(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                const ChildStreams& streams) {
  pid_t process = 0;
  const int error = SpawnSetting(streams).spawn(process, program, arguments);
  if (error == 0) return process;
  if (error == ENOENT || error == ENOTDIR)
    return fail(ErrorCode::kNotFound, "is not installed: reinstall the packages of slsd", program.string());
  return fail(ErrorCode::kIo, "does not start: " + std::generic_category().message(error), program.string());
}

}  // namespace slsd
