// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "daemon/scan/wait_limit.hpp"

namespace slsd {

/// A client's request to the devices, from its arrival to its single outcome. The first to end it wins: finished work,
/// the deadline, a client that hung up, or a stop of the service. Later outcomes are dropped.
///
///     waiting --its turn--> under way --done--> over
///        \______________________\____ deadline, hang-up, stop ____/
///
/// @thread thread-safe
class Task : public std::enable_shared_from_this<Task> {  // shared: whoever ends it may be its last owner
 public:
  explicit Task(MonotonicTime deadline) : deadline_(deadline) {}
  virtual ~Task() = default;
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;

  [[nodiscard]] MonotonicTime deadline() const { return deadline_; }
  [[nodiscard]] bool over() const { return over_.stop_requested(); }

  /// The limits of the wait for its work. The wait reports the devices that it waits for.
  [[nodiscard]] WaitLimit limit() {
    WaitLimit limit(deadline_, over_.get_token());
    limit.waits_for = [this](const std::string& device) {
      const std::lock_guard lock(mutex_);
      waits_for_ = device;
    };
    return limit;
  }
  /// The device that it waits for, or waited for last: "camera left". Empty before its turn.
  [[nodiscard]] std::string waits_for() const {
    const std::lock_guard lock(mutex_);
    return waits_for_;
  }

  /// Sleeps for the time, or until the task is over.
  void pause(std::chrono::milliseconds time) const {
    std::mutex none;
    std::unique_lock lock(none);
    std::condition_variable_any never;
    never.wait_for(lock, over_.get_token(), time, [] { return false; });
  }

  /// Ends it with an error.
  virtual void fail_with(Error error) = 0;

  /// Ends it when its client hangs up.
  void end_with(const std::stop_token& gone) { hung_up_.emplace(gone, HungUp{weak_from_this()}); }

 protected:
  /// @return whether this call ended it; if so, the caller answers
  [[nodiscard]] bool finish() { return over_.request_stop(); }

 private:
  struct HungUp {
    std::weak_ptr<Task> task;
    void operator()() const {
      if (const auto known = task.lock()) known->fail_with({ErrorCode::kCancelled, "the client disconnected", {}});
    }
  };

  MonotonicTime deadline_;
  std::stop_source over_;
  mutable std::mutex mutex_;
  std::string waits_for_;
  std::optional<std::stop_callback<HungUp>> hung_up_;
};

/// A task with its answer, which is called exactly once.
template <class Value>
class TaskOf : public Task {
 public:
  using Answer = std::function<void(Result<Value>)>;
  TaskOf(MonotonicTime deadline, Answer answer) : Task(deadline), answer_(std::move(answer)) {}

  void end(Result<Value> outcome) {
    if (finish() && answer_) answer_(std::move(outcome));
  }
  void fail_with(Error error) override { end(tl::unexpected(std::move(error))); }

 private:
  Answer answer_;
};

}  // namespace slsd
