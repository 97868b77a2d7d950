// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/confine/confine.hpp"

#include <linux/capability.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <memory>
#include <system_error>

namespace slsd {
namespace {

constexpr rlim_t kMemoryBytes = 256 << 20;  // for a 4K picture, its file and the libraries
constexpr rlim_t kProcessorSeconds = 10;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

constexpr int kAllowed[] = {SCMP_SYS(read),   SCMP_SYS(write),   SCMP_SYS(brk),  SCMP_SYS(munmap),
                            SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(exit), SCMP_SYS(exit_group)};

void limit(__rlimit_resource_t what, rlim_t most) {
  const rlimit both{most, most};
  ::setrlimit(what, &both);
}

void drop_capabilities() {
  ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  const __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3]{};
  ::syscall(SYS_capset, &header, none);
}

/// Kills the only thread, and so the process. libseccomp asks the kernel for SCMP_ACT_KILL_PROCESS by seccomp(2), which
/// systemd's @system-service forbids the service up to version 252.
constexpr std::uint32_t kKill = SCMP_ACT_KILL_THREAD;

/// Forbids this process all other system calls, and memory that is executable or of a file.
/// @return  0, or a negative error number
int filter_system_calls() {
  const std::unique_ptr<void, decltype(&seccomp_release)> filter(seccomp_init(kKill), seccomp_release);
  if (filter == nullptr) return -EINVAL;
  int error = seccomp_attr_set(filter.get(), SCMP_FLTATR_ACT_BADARCH, kKill);
  for (const int call : kAllowed)
    if (error == 0) error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0);
  if (error == 0)
    error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(mmap), 2, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0),
                             SCMP_A3(SCMP_CMP_MASKED_EQ, MAP_ANONYMOUS, MAP_ANONYMOUS));
  return error == 0 ? seccomp_load(filter.get()) : error;  // which also forbids new privileges
}

}  // namespace

Result<> confine() {
  if (kSanitized) return {};
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, kProcessorSeconds);
  limit(RLIMIT_AS, kMemoryBytes);
  drop_capabilities();
  const int error = filter_system_calls();
  if (error == 0) return {};
  return fail(ErrorCode::kUnsupported,
              "this kernel cannot filter system calls: " + std::generic_category().message(-error));
}

}  // namespace slsd
