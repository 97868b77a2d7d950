// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/lent_memory.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/system/sealed_memory.hpp"

namespace slsd {

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
