// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/confine/confine.hpp"

#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <functional>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

namespace slsd {
namespace {

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

struct Attempt {
  std::string name;
  std::function<void()> make;
};

class Confined : public ::testing::TestWithParam<Attempt> {};

TEST_P(Confined, IsKilled) {
  const auto attempt = [] {
    if (!confine()) ::_exit(1);
    GetParam().make();
    ::_exit(0);
  };
  EXPECT_EXIT(attempt(), ::testing::KilledBySignal(SIGSYS), "");
}

INSTANTIATE_TEST_SUITE_P(
    Attempts, Confined,
    ::testing::Values(Attempt{"Open", [] { ::open("/dev/null", O_RDONLY); }},
                      Attempt{"Socket", [] { ::socket(AF_UNIX, SOCK_STREAM, 0); }},
                      Attempt{"Fork", [] { ::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }},
                      Attempt{"Execute", [] { ::execl("/bin/true", "true", nullptr); }},
                      Attempt{"Signal", [] { ::kill(::getppid(), SIGTERM); }},
                      Attempt{"Trace", [] { ::syscall(SYS_ptrace, 0, 0, 0, 0); }},
                      Attempt{"ExecutableMemory",
                              [] { ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); }},
                      Attempt{"MappedFile", [] { ::mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE, 0, 0); }},
                      Attempt{"Limit",
                              [] {
                                const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
                                ::setrlimit(RLIMIT_AS, &all);
                              }}),
    [](const auto& instance) { return instance.param.name; });

// As systemd's @system-service does up to version 252. Not by libseccomp, which remembers what the kernel allowed
// before.
bool forbid_seccomp() {
  sock_filter code[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
                        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_seccomp, 0, 1),
                        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
                        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
  const sock_fprog program{static_cast<unsigned short>(std::size(code)), code};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0 &&
         ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) != 0 && errno == EPERM;
}

TEST(Confine, WorksInAServiceThatMayNotCallSeccomp) {
  const auto attempt = [] {
    if (!forbid_seccomp()) ::_exit(3);
    if (!confine()) ::_exit(1);
    ::open("/dev/null", O_RDONLY);
    ::_exit(0);
  };
  EXPECT_EXIT(attempt(), ::testing::KilledBySignal(SIGSYS), "");
}

TEST(Confine, LeavesComputingReadingAndWriting) {
  const auto work = [] {
    if (!confine()) ::_exit(1);
    void* const memory = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    const bool works = memory != nullptr && ::write(STDERR_FILENO, "here", 4) == 4;
    ::_exit(works ? 0 : 1);
  };
  EXPECT_EXIT(work(), ::testing::ExitedWithCode(0), "here");
}

TEST(Confine, TakesNoMemoryBeyondItsLimit) {
  const auto take = [] {
    if (!confine()) ::_exit(1);
    ::_exit(::mmap(nullptr, 300u << 20, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED ? 0 : 2);
  };
  EXPECT_EXIT(take(), ::testing::ExitedWithCode(0), "");
}

#endif

}  // namespace
}  // namespace slsd
