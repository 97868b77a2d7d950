// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "core/result.hpp"
#include "daemon/scan/wait_limit.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/system/heartbeat.hpp"

namespace slsd {

/// A computation on frames, whose result is then delivered. The lanes share it with those who may end it early.
class FrameJob {
 public:
  virtual ~FrameJob() = default;
  /// The long part. Other lanes run other jobs at the same time.
  /// @param lane  the lowest that is free, so that jobs which do not overlap share one lane's buffers
  virtual void compute(std::size_t lane) = 0;
  /// Follows compute() on the same lane if memory ran out in it. The result is then this error.
  virtual void fail_compute(std::size_t lane, Error error) = 0;
  /// Delivers the result once. Follows compute(), or replaces it if the service stops. Runs for one job at a time, in
  /// order of arrival.
  virtual void deliver() = 0;
};

/// The threads that decode while the next frames are taken. A few jobs wait in front of one or two lanes. Results are
/// delivered in order of arrival, even if a later job ends first.
///
///     capture --> [ ] +--> lane 0 --+--> deliver, in order
///                     +--> lane 1 --+
///
/// @thread thread-safe
class DecodeLanes {
 public:
  static constexpr std::size_t kMaxLanes = 2;
  static constexpr std::size_t kWaitingMax = 3;
  /// The longest wait of an offered job when more jobs come. A lane that is late once loses nothing. Lanes that are
  /// slower than the cameras make no cloud older than this.
  static constexpr std::chrono::milliseconds kTurn{20};
  /// The number of lanes for this machine: one if there is but one processor.
  [[nodiscard]] static std::size_t lanes_here();

  explicit DecodeLanes(std::size_t lanes);
  ~DecodeLanes();
  DecodeLanes(const DecodeLanes&) = delete;
  DecodeLanes& operator=(const DecodeLanes&) = delete;

  /// Waits until no other job waits. The job is certain to be delivered.
  void push(std::shared_ptr<FrameJob> job);
  /// Offers a job that may be skipped; the newest wins. If too many jobs wait, or the oldest offered one has waited too
  /// long, that one is destroyed undelivered.
  void offer(std::shared_ptr<FrameJob> job, MonotonicTime now = std::chrono::steady_clock::now());
  /// The number of offered jobs destroyed undelivered since the start.
  [[nodiscard]] std::uint64_t skipped() const;

  /// Waits until more than `done` jobs are done. @return false: no job is under way, or the limit ended first
  [[nodiscard]] bool wait_done(std::uint64_t done, const WaitLimit& limit);
  /// The number of jobs delivered or destroyed so far.
  [[nodiscard]] std::uint64_t done() const;

  /// Tells whether the lanes keep their promises to the watchdog.
  [[nodiscard]] bool kept() const;
  /// Stops soon: delivers waiting jobs without computing them. Later pushes deliver at once.
  void request_stop();
  [[nodiscard]] bool stopped() const;

 private:
  struct Waiting {
    std::shared_ptr<FrameJob> job;
    bool may_be_skipped = false;
    MonotonicTime since;  ///< time of the offer, if the job may be skipped
  };
  void run(std::size_t thread, const std::stop_token& stop);
  void append(Waiting waiting, std::unique_lock<std::mutex>& lock);
  void make_room(MonotonicTime now);
  void deliver(FrameJob& job, std::uint64_t turn, std::size_t lane);

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Waiting> waiting_;
  std::uint64_t arrived_ = 0;    ///< jobs put in, less those skipped
  std::uint64_t taken_ = 0;      ///< jobs taken by lanes
  std::uint64_t delivered_ = 0;  ///< jobs delivered, of those taken
  std::uint64_t skipped_ = 0;
  std::size_t running_ = 0;
  std::array<bool, kMaxLanes> busy_{};  ///< lanes with a job
  std::array<Heartbeat, kMaxLanes> heartbeats_;
  std::array<std::jthread, kMaxLanes> threads_;
};

}  // namespace slsd
