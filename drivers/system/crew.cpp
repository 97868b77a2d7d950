// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/crew.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <string>
#include <utility>

#include "drivers/system/thread_name.hpp"

namespace slsd {
namespace {

/// Spins until the predicate holds, or for a short time. The stages of a frame are some microseconds apart, and a
/// sleeping thread takes longer to wake up.
template <class Predicate>
void stay_awake(Predicate&& is_so) {
  constexpr std::chrono::microseconds kAwake{50};
  const auto end = std::chrono::steady_clock::now() + kAwake;
  while (!is_so() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
}

}  // namespace

int Crew::helpers_here() {
  constexpr int kMost = 15;
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()) - 1, 0, kMost);
}

Crew::Crew(int helpers) {
  for (int worker = 1; worker <= helpers; ++worker)
    threads_.emplace_back([this, worker](const std::stop_token& stop) { help(worker, stop); });
}

Crew::~Crew() {
  for (std::jthread& thread : threads_) thread.request_stop();
}

void Crew::run_parts(int parts, Part part, const void* work) {
  const std::unique_lock alone(in_use_, std::try_to_lock);
  if (parts < 2 || threads_.empty() || !alone) {
    for (int i = 0; i < parts; ++i) part(work, i, 0);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    part_ = part, work_ = work, parts_ = parts, next_ = 0;
    on_offer_ = ++call_;
  }
  changed_.notify_all();
  take_parts(0, part, work, parts);
  {
    const std::lock_guard lock(mutex_);
    on_offer_ = 0;
  }
  // Stay awake while helpers end their last parts.
  stay_awake([this] { return helping_ == 0; });
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return helping_ == 0; });
  if (const auto failed = std::exchange(failed_, nullptr)) std::rethrow_exception(failed);
}

// If memory runs out in a part, the others are dropped, and the caller throws after the last helper ended.
void Crew::take_parts(int worker, Part part, const void* work, int parts) {
  try {
    for (int i = next_++; i < parts; i = next_++) part(work, i, worker);
  } catch (...) {
    next_ = parts;
    const std::lock_guard lock(mutex_);
    failed_ = std::current_exception();
  }
}

void Crew::help(int worker, const std::stop_token& stop) {
  name_this_thread("helper " + std::to_string(worker));
  std::uint64_t done = 0;
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return wants(done); })) {
    done = call_;
    ++helping_;
    const Part part = part_;
    const void* const work = work_;
    const int parts = parts_;
    lock.unlock();
    take_parts(worker, part, work, parts);
    lock.lock();
    --helping_;
    lock.unlock();
    changed_.notify_all();
    stay_awake([&] { return wants(done) || stop.stop_requested(); });
    lock.lock();
  }
}

}  // namespace slsd
