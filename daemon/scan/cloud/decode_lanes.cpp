// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/decode_lanes.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "daemon/scan/within_memory.hpp"
#include "drivers/system/thread_name.hpp"

namespace slsd {

std::size_t DecodeLanes::lanes_here() {
  return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMaxLanes);
}

DecodeLanes::DecodeLanes(std::size_t lanes) : running_(std::min(lanes, kMaxLanes)) {
  for (std::size_t thread = 0; thread < std::min(lanes, kMaxLanes); ++thread) {
    threads_[thread] = std::jthread([this, thread](const std::stop_token& stop) { run(thread, stop); });
  }
}

DecodeLanes::~DecodeLanes() {
  request_stop();
}

void DecodeLanes::request_stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
}

bool DecodeLanes::stopped() const {
  const std::lock_guard lock(mutex_);
  return running_ == 0;
}

bool DecodeLanes::kept() const {
  return std::ranges::all_of(heartbeats_, [](const Heartbeat& heartbeat) { return heartbeat.kept(); });
}

std::uint64_t DecodeLanes::skipped() const {
  const std::lock_guard lock(mutex_);
  return skipped_;
}

std::uint64_t DecodeLanes::done() const {
  const std::lock_guard lock(mutex_);
  return delivered_ + skipped_;
}

bool DecodeLanes::wait_done(std::uint64_t done, const WaitLimit& limit) {
  std::unique_lock lock(mutex_);
  const auto another = [&] { return delivered_ + skipped_ > done; };
  if (another()) return true;
  if (delivered_ == arrived_) return false;
  return limit.wait_until(limit.deadline, changed_, lock, another);
}

void DecodeLanes::push(std::shared_ptr<FrameJob> job) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() || running_ == 0; });
  append({std::move(job), false, {}}, lock);
}

void DecodeLanes::offer(std::shared_ptr<FrameJob> job, MonotonicTime now) {
  std::unique_lock lock(mutex_);
  make_room(now);
  append({std::move(job), true, now}, lock);
}

// Always makes room: at most one waiting job was pushed, and the others may be skipped.
void DecodeLanes::make_room(MonotonicTime now) {
  for (;;) {
    const auto oldest = std::ranges::find_if(waiting_, &Waiting::may_be_skipped);
    if (oldest == waiting_.end()) return;
    if (waiting_.size() < kWaitingMax && now - oldest->since <= kTurn) return;
    waiting_.erase(oldest);
    --arrived_;
    ++skipped_;
  }
}

// After the last lane's end nobody else delivers jobs.
void DecodeLanes::append(Waiting waiting, std::unique_lock<std::mutex>& lock) {
  if (running_ == 0) {
    lock.unlock();
    return waiting.job->deliver();
  }
  waiting_.push_back(std::move(waiting));
  ++arrived_;
  lock.unlock();
  changed_.notify_all();
}

void DecodeLanes::run(std::size_t thread, const std::stop_token& stop) {
  name_this_thread("decode " + std::to_string(thread));
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
    std::shared_ptr<FrameJob> job = std::move(waiting_.front().job);
    waiting_.pop_front();
    const std::uint64_t turn = taken_++;
    const auto lane = static_cast<std::size_t>(std::ranges::find(busy_, false) - busy_.begin());
    busy_[lane] = true;
    lock.unlock();
    changed_.notify_all();  // push() waits for room
    heartbeats_[thread].promise(kWorkPromise);
    if (!stop.stop_requested())
      within_memory([&] { job->compute(lane); }, [&] { job->fail_compute(lane, out_of_memory()); });
    deliver(*job, turn, lane);
    job.reset();
    heartbeats_[thread].rest();
    lock.lock();
  }
  --running_;
  changed_.notify_all();
}

void DecodeLanes::deliver(FrameJob& job, std::uint64_t turn, std::size_t lane) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return delivered_ == turn; });
  }
  job.deliver();
  {
    const std::lock_guard lock(mutex_);
    ++delivered_;
    busy_[lane] = false;
  }
  changed_.notify_all();
}

}  // namespace slsd
