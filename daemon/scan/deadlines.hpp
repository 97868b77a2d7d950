// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "daemon/scan/task.hpp"

namespace slsd {

/// The thread that ends tasks whose time is over, whatever the threads that work on them are doing. One that waits for
/// its turn ends at its deadline; one that is under way has a little longer, as those who wait for its device know best
/// why it is late.
/// @thread thread-safe
class Deadlines {
 public:
  static constexpr std::chrono::milliseconds kGrace{800};

  /// @param reason  why a task was not done in time; called on the thread
  explicit Deadlines(std::function<Error(const Task&)> reason);
  Deadlines(const Deadlines&) = delete;
  Deadlines& operator=(const Deadlines&) = delete;

  void watch(const std::shared_ptr<Task>& task);

 private:
  void run(const std::stop_token& stop);
  [[nodiscard]] std::vector<std::shared_ptr<Task>> take_overdue();

  std::function<Error(const Task&)> reason_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<std::weak_ptr<Task>> tasks_;  ///< weak: they belong to those who work on them
  MonotonicTime next_ = MonotonicTime::max();
  std::jthread thread_;
};

}  // namespace slsd
