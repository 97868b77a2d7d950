// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/sealed_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace slsd {
namespace {

tl::unexpected<Error> fail_with_errno(const char* what) {
  const int number = errno;
  const ErrorCode code = number == ENOSPC || number == ENOMEM ? ErrorCode::kNoSpace : ErrorCode::kIo;
  return fail(code, std::string(what) + ": " + std::strerror(number));
}

}  // namespace

Result<FileDescriptor> sealed_memory(std::string_view bytes) {
  FileDescriptor memory(::memfd_create("slsd-cloud", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory) return fail_with_errno("cannot make a memfd");
  for (std::string_view rest = bytes; !rest.empty();) {
    const ssize_t written = ::write(memory.number(), rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return fail_with_errno("cannot fill a memfd");
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  ::lseek(memory.number(), 0, SEEK_SET);
  if (::fcntl(memory.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) != 0) {
    return fail_with_errno("cannot seal a memfd");
  }
  return memory;
}

}  // namespace slsd
