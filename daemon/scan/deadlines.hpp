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

/// The thread that ends tasks at their deadlines, whatever other threads do. A waiting task ends at its deadline. A
/// task under way has a little longer, because its waits know best which device is late.
/// @thread thread-safe
class Deadlines {
 public:
  static constexpr std::chrono::milliseconds kGrace{800};

  /// @param reason  tells why a task was late; called on this thread
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
  std::vector<std::weak_ptr<Task>> tasks_;  ///< weak: the tasks belong to the threads that work on them
  MonotonicTime next_ = MonotonicTime::max();
  std::jthread thread_;
};

}  // namespace slsd
