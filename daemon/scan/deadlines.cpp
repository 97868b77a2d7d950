// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/deadlines.hpp"

#include <algorithm>
#include <utility>

#include "drivers/system/thread_name.hpp"

namespace slsd {
namespace {

MonotonicTime end_of(const Task& task) {
  return task.waits_for().empty() ? task.deadline() : task.deadline() + Deadlines::kGrace;
}

}  // namespace

Deadlines::Deadlines(std::function<Error(const Task&)> reason) : reason_(std::move(reason)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Deadlines::watch(const std::shared_ptr<Task>& task) {
  const std::lock_guard lock(mutex_);
  std::erase_if(tasks_, [](const std::weak_ptr<Task>& each) {
    const auto known = each.lock();
    return !known || known->over();
  });
  tasks_.push_back(task);
  if (task->deadline() >= next_) return;
  next_ = task->deadline();
  changed_.notify_one();
}

void Deadlines::run(const std::stop_token& stop) {
  name_this_thread("deadlines");
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const MonotonicTime wake = next_;
    if (wake == MonotonicTime::max()) {
      changed_.wait(lock, stop, [&] { return next_ < wake; });
    } else {
      changed_.wait_until(lock, stop, wake, [&] { return next_ < wake; });
    }
    const auto overdue = take_overdue();
    lock.unlock();
    for (const auto& task : overdue) task->fail_with(reason_(*task));
    lock.lock();
  }
}

std::vector<std::shared_ptr<Task>> Deadlines::take_overdue() {
  const MonotonicTime now = std::chrono::steady_clock::now();
  std::vector<std::shared_ptr<Task>> overdue;
  next_ = MonotonicTime::max();
  std::erase_if(tasks_, [&](const std::weak_ptr<Task>& each) {
    auto task = each.lock();
    if (!task || task->over()) return true;
    const MonotonicTime end = end_of(*task);
    if (end > now) return next_ = std::min(next_, end), false;
    overdue.push_back(std::move(task));
    return true;
  });
  return overdue;
}

}  // namespace slsd
