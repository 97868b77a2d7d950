// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <mutex>
#include <set>

namespace slsd::dds {

/// Notices a write that does not end. Fast DDS may keep one waiting without limit: its flow controller's thread looks
/// again and again for the writer's lock, and hardly lets go of the lock that the write needs.
/// @thread thread-safe
class WriteWatch {
 public:
  /// A write under way.
  class Writing {
   public:
    explicit Writing(WriteWatch& watch) : watch_(watch) {
      const std::lock_guard lock(watch_.mutex_);
      number_ = ++watch_.begun_;
      watch_.under_way_.insert(number_);
    }
    ~Writing() {
      const std::lock_guard lock(watch_.mutex_);
      watch_.under_way_.erase(number_);
    }
    Writing(const Writing&) = delete;
    Writing& operator=(const Writing&) = delete;

   private:
    WriteWatch& watch_;
    std::uint64_t number_;
  };

  /// Call it once a second: looks, and counts how often the same oldest write was under way. Counts looks, not seconds,
  /// because the process may have been stopped meanwhile.
  [[nodiscard]] int look() {
    const std::lock_guard lock(mutex_);
    const std::uint64_t oldest = under_way_.empty() ? 0 : *under_way_.begin();
    looks_ = oldest == 0 || oldest != seen_ ? 0 : looks_ + 1;
    seen_ = oldest;
    return looks_;
  }

 private:
  std::mutex mutex_;
  std::set<std::uint64_t> under_way_;
  std::uint64_t begun_ = 0, seen_ = 0;
  int looks_ = 0;
};

}  // namespace slsd::dds
