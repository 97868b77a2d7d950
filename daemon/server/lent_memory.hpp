// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <vector>

#include "core/result.hpp"
#include "daemon/server/memory_budget.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// The memfds that clients use. They count as this process's memory until the last client has closed and unmapped them.
/// Clients need not report that, and a malicious client never does.
/// @thread thread-bound
class LentMemory {
 public:
  /// More memfds would use up the descriptors.
  static constexpr std::size_t kMemoriesMax = 256;

  explicit LentMemory(MemoryBudget& budget) : budget_(budget) {}
  ~LentMemory();
  LentMemory(const LentMemory&) = delete;
  LentMemory& operator=(const LentMemory&) = delete;

  /// Counts a memfd from now on; call it before sending. @param kept  of sealed_memory()
  /// @errors kBusy: too much is lent already
  /// @param to  who gets the memory; null: nobody in particular
  [[nodiscard]] Result<> add(FileDescriptor kept, std::size_t bytes, const void* to = nullptr);
  /// Forgets memfds that nobody uses any more.
  void sweep();
  [[nodiscard]] std::size_t count() const { return lent_.size(); }
  /// The number of memfds that somebody still uses.
  [[nodiscard]] std::size_t count_of(const void* to);

 private:
  struct Lent {
    FileDescriptor kept;
    std::size_t bytes;
    const void* to;
  };
  MemoryBudget& budget_;
  std::vector<Lent> lent_;
};

}  // namespace slsd
