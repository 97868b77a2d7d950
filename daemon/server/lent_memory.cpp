// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/lent_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <utility>

#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

FileDescriptor open_to_read(const FileDescriptor& memory) {
  const std::string path = "/proc/self/fd/" + std::to_string(memory.number());
  return FileDescriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
}

// The kernel grants a write lease only to the sole opener of a file, and a mapping counts as an opening. If it grants
// no lease at all (an error other than EAGAIN), the memory is not watched.
bool is_held_by_others(const FileDescriptor& kept) {
  if (::fcntl(kept.number(), F_SETLEASE, F_WRLCK) != 0) return errno == EAGAIN;
  ::fcntl(kept.number(), F_SETLEASE, F_UNLCK);
  return false;
}

}  // namespace

Result<SealedMemory> sealed_memory(std::string_view bytes) {
  const FileDescriptor memory(::memfd_create("slsd-cloud", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory) return fail_system(errno, "cannot create a memfd");
  for (std::string_view rest = bytes; !rest.empty();) {
    const ssize_t written = ::write(memory.number(), rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return fail_system(errno, "cannot fill a memfd");
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::fcntl(memory.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) != 0) {
    return fail_system(errno, "cannot seal a memfd");
  }
  // Opens the file twice more, because the first descriptor, open for writing, would prevent the lease.
  SealedMemory sealed{open_to_read(memory), open_to_read(memory), bytes.size()};
  if (!sealed.given || !sealed.kept) return fail_system(errno, "cannot open a memfd for reading");
  return sealed;
}

LentMemory::~LentMemory() {
  for (const Lent& lent : lent_) budget_.give_back(lent.bytes);
}

Result<> LentMemory::add(FileDescriptor kept, std::size_t bytes, const void* to) {
  sweep();
  if (lent_.size() == kMemoriesMax || !budget_.lend(bytes)) {
    return fail(ErrorCode::kBusy, "clients still hold " + std::to_string(lent_.size()) +
                                      " clouds that were sent as memfds (" + std::to_string(budget_.lent() >> 20U) +
                                      " MB): close them, or ask for \"transport\": \"inline\"");
  }
  lent_.push_back({std::move(kept), bytes, to});
  return {};
}

std::size_t LentMemory::count_of(const void* to) {
  sweep();
  return static_cast<std::size_t>(std::ranges::count(lent_, to, &Lent::to));
}

void LentMemory::sweep() {
  std::erase_if(lent_, [this](const Lent& lent) {
    if (is_held_by_others(lent.kept)) return false;
    budget_.give_back(lent.bytes);
    return true;
  });
}

}  // namespace slsd
