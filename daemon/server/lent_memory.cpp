// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/lent_memory.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <utility>

namespace slsd {
namespace {

// The kernel grants a write lease only to the sole opener of a file, and a mapping counts as an opening. If it grants
// no lease at all (an error other than EAGAIN), the memory is not watched.
bool is_held_by_others(const FileDescriptor& kept) {
  if (::fcntl(kept.number(), F_SETLEASE, F_WRLCK) != 0) return errno == EAGAIN;
  ::fcntl(kept.number(), F_SETLEASE, F_UNLCK);
  return false;
}

}  // namespace

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
