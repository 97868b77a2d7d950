// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "daemon/server/memory_budget.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// A memfd that holds bytes and can neither change nor shrink nor grow.
struct SealedMemory {
  FileDescriptor given;  ///< the client's descriptor, to be read and mapped
  FileDescriptor kept;   ///< our descriptor, which shows whether anybody still has the memory
  std::size_t bytes = 0;
};

/// @errors kNoSpace: out of memory or of descriptors; kIo
/// @thread reentrant
[[nodiscard]] Result<SealedMemory> sealed_memory(std::string_view bytes);

/// The memfds that clients have. They count as this process's memory until the last client has closed and unmapped
/// them, which it need not tell us, and which a client that means harm never does.
/// @thread thread-bound
class LentMemory {
 public:
  /// More would take all descriptors.
  static constexpr std::size_t kMemoriesMax = 256;

  explicit LentMemory(MemoryBudget& budget) : budget_(budget) {}
  ~LentMemory();
  LentMemory(const LentMemory&) = delete;
  LentMemory& operator=(const LentMemory&) = delete;

  /// Counts it from now on, before it is sent. @param kept  of sealed_memory()
  /// @errors kBusy: too much is lent already
  /// @param to  who it is lent to; null: nobody in particular
  [[nodiscard]] Result<> add(FileDescriptor kept, std::size_t bytes, const void* to = nullptr);
  /// Forgets those that nobody has any more.
  void sweep();
  [[nodiscard]] std::size_t count() const { return lent_.size(); }
  /// The number of pieces that somebody still has.
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
