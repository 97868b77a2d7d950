// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

namespace slsd {

/// A queue between two threads that never grows beyond its capacity.
/// @thread thread-safe
template <class Item>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Pushes the item if there is room, and returns whether there was. Otherwise the item stays as it is.
  [[nodiscard]] bool try_push(Item&& item) {
    {
      const std::lock_guard lock(mutex_);
      if (items_.size() >= capacity_) return false;
      items_.push_back(std::move(item));
    }
    changed_.notify_one();
    return true;
  }

  /// Takes the oldest item. Returns nothing if the time comes or a stop is requested first.
  template <class TimePoint>
  [[nodiscard]] std::optional<Item> pop_until(TimePoint time, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, stop, time, [this] { return !items_.empty() || std::exchange(woken_, false); });
    return take();
  }

  [[nodiscard]] std::optional<Item> try_pop() {
    const std::lock_guard lock(mutex_);
    return take();
  }

  /// Removes the items that nobody needs any more.
  template <class Needless>
  void erase_if(Needless needless) {
    const std::lock_guard lock(mutex_);
    std::erase_if(items_, needless);
  }

  /// Ends the current pop_until(), or the next one, with nothing.
  void wake() {
    {
      const std::lock_guard lock(mutex_);
      woken_ = true;
    }
    changed_.notify_one();
  }

 private:
  [[nodiscard]] std::optional<Item> take() {
    if (items_.empty()) return std::nullopt;
    std::optional<Item> item(std::move(items_.front()));
    items_.pop_front();
    return item;
  }

  std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Item> items_;
  bool woken_ = false;
};

}  // namespace slsd
