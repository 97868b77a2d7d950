// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <shared_mutex>

namespace slsd::dds {

/// Many threads use a network until one leaves it.
/// @thread thread-safe
class Leaving {
 public:
  using Use = std::shared_lock<std::shared_mutex>;

  /// Keeps the network while the lock lasts. Once leave() began, the lock is not owned: the network must not be used.
  [[nodiscard]] Use use() {
    if (began_) return {};
    Use use(in_use_);
    if (began_) use.unlock();
    return use;
  }

  /// Waits for the uses under way, and lets no other begin: glibc prefers shared locks, and overlapping ones would keep
  /// this one waiting. @return not owned: another call began earlier
  [[nodiscard]] std::unique_lock<std::shared_mutex> leave() {
    if (began_.exchange(true)) return {};
    return std::unique_lock(in_use_);
  }

 private:
  std::atomic<bool> began_{false};
  std::shared_mutex in_use_;
};

}  // namespace slsd::dds
