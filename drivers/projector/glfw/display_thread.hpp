// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "core/result.hpp"

namespace slsd {

/// A thread that does one job at a time, and in between waits for events, at no cost.
/// @thread thread-safe
class DisplayThread {
 public:
  /// @param handle_events  called on the thread after each job and when there are events; returns the descriptor that
  /// is
  ///                       readable when there are more, -1: none
  explicit DisplayThread(std::function<int()> handle_events);
  ~DisplayThread();
  DisplayThread(const DisplayThread&) = delete;
  DisplayThread& operator=(const DisplayThread&) = delete;

  /// @errors kNoSpace: no descriptor or no thread is left
  [[nodiscard]] Result<> start();

  [[nodiscard]] bool started() const { return thread_.joinable(); }

  /// Runs the job on the thread and waits for its end. Started before.
  void run(const std::function<void()>& job);

 private:
  void serve(const std::stop_token& stop);
  void take_job();
  void wake() const;

  std::function<int()> handle_events_;
  int wake_descriptor_ = -1;
  std::mutex mutex_;  ///< guards job_
  std::condition_variable done_;
  const std::function<void()>* job_ = nullptr;
  std::jthread thread_;
};

}  // namespace slsd
