// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

namespace slsd::test {

/// While it lives, the process gets no more file descriptors: each call that would make one fails with EMFILE. Those
/// below the limit are all in use; a limit of zero would fail poll(), too.
class NoDescriptors {
 public:
  NoDescriptors() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const int lowest_free = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    ::close(lowest_free);
    const rlimit none{static_cast<rlim_t>(lowest_free), before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;

 private:
  rlimit before_{};
};

}  // namespace slsd::test
