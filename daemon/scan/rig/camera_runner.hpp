// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/result.hpp"
#include "daemon/scan/rig/device_status.hpp"
#include "daemon/scan/wait_limit.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/system/heartbeat.hpp"

namespace slsd {

/// The choice of the frame that a capture takes.
enum class Exposure {
  kFresh,  ///< the first frame whose exposure begins after the capture
  kNext,   ///< the next frame, if the camera runs freely
};

/// Counts frames that are missing from the sequence and that no error has reported.
/// @thread thread-bound
class SequenceGaps {
 public:
  /// Begins again when the device restarts its count.
  void restart() { *this = {}; }
  /// Notes that an error reported a lost frame.
  void note_failure() { ++failures_; }
  /// @return how many frames before this one were lost without an error
  [[nodiscard]] std::uint64_t note_frame(std::uint64_t sequence) {
    const std::uint64_t missing = last_ && sequence > *last_ ? sequence - *last_ - 1 : 0;
    const std::uint64_t told = std::min(missing, failures_);
    last_ = sequence;
    failures_ = 0;
    return missing - told;
  }

 private:
  std::optional<std::uint64_t> last_;
  std::uint64_t failures_ = 0;
};

/// Runs and supervises one camera on a thread of its own. Opens the camera, and reopens a lost one for ever, with
/// growing pauses. Looks after it between captures, and takes a frame on request. Logs the first failure and the
/// recovery, not each attempt. docs/supervision.md draws the states.
/// @thread thread-safe, except the captures, which belong to one thread
class CameraRunner {
 public:
  /// @param exposures_us  exposures of one scan, in their order; empty: one, as the camera opens
  CameraRunner(std::unique_ptr<Camera> camera, const ScanOptions& options, std::vector<double> exposures_us = {});
  /// Waits for the thread. If the device is gone, closing it may take seconds.
  ~CameraRunner();
  CameraRunner(const CameraRunner&) = delete;
  CameraRunner& operator=(const CameraRunner&) = delete;

  /// Ends waits and the thread soon. Later requests fail with kCancelled.
  void request_stop();
  /// Tells whether the thread has ended and the camera is closed.
  [[nodiscard]] bool stopped() const { return ended_; }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] DeviceStatus status() const;
  /// The number of times the camera was opened.
  [[nodiscard]] std::uint64_t openings() const;
  [[nodiscard]] const Heartbeat& heartbeat() const { return heartbeat_; }
  /// Tells whether the camera replays recorded images.
  [[nodiscard]] bool replays() const { return replays_; }
  /// The frame rate of a camera that runs freely; 0 for any other.
  [[nodiscard]] double rate_hz() const { return rate_hz_; }

  /// Waits until the camera is open.
  /// @errors kTimeout, with the reason why the camera is not open; kCancelled
  [[nodiscard]] Result<> wait_ready(const WaitLimit& limit);

  /// Replaces this camera by one with other settings of the same device: closes this one and opens the next. If the
  /// device was open and refuses the settings, or takes longer than the deadline, opens `otherwise`, a new copy of the
  /// old camera. If the device was not open, `next` is opened as soon as possible.
  /// @errors of Camera::open(): why it refuses; kTimeout: the camera's thread was not free in time; kCancelled
  [[nodiscard]] Result<> replace(std::unique_ptr<Camera> next, std::unique_ptr<Camera> otherwise,
                                 MonotonicTime deadline);

  /// The exposures of one scan; empty if it has only one.
  [[nodiscard]] const std::vector<double>& exposures_us() const { return exposures_us_; }

  /// Starts the exposure of one frame now. wait_captured() and end_capture() finish the capture.
  /// @param round  the index of its exposure, if a scan has several
  void begin_capture(MonotonicTime deadline, Exposure exposure = Exposure::kFresh, Picture light = Picture::kPattern,
                     std::size_t round = 0);
  /// Waits for the driver's answer. @return whether it has come, or will never come
  [[nodiscard]] bool wait_captured(const WaitLimit& limit, MonotonicTime until);
  /// Makes a driver that has not answered yet do so now.
  void cancel_capture();
  /// Takes the driver's answer. Abandons a driver that has none; when it answers, the camera is reopened.
  /// @errors as Camera::capture(); kCancelled, kTimeout: the camera is no longer ready
  [[nodiscard]] Result<Frame> end_capture();

 private:
  struct Order {
    MonotonicTime deadline;
    Exposure exposure = Exposure::kFresh;
    Picture light = Picture::kPattern;
    std::size_t round = 0;
    bool cancelled = false;
  };
  struct Replacement {
    std::unique_ptr<Camera> next;
    std::unique_ptr<Camera> otherwise;
    std::uint64_t number = 0;
  };
  void run(const std::stop_token& stop);
  void close();
  [[nodiscard]] std::optional<Replacement> take_replacement();
  void exchange(Replacement replacement);
  void put(std::unique_ptr<Camera> camera);
  void cancel();
  [[nodiscard]] Result<> open_camera();
  void open_or_pause(const std::stop_token& stop);
  void note_found();
  void note_opened(const Result<>& opened);
  void look_after();
  void note_figures(const std::unique_lock<std::mutex>& lock);
  void note_lost(const Error& error, std::unique_lock<std::mutex> lock);
  [[nodiscard]] std::optional<Order> next_order(const std::stop_token& stop);
  void take_frame(const Order& order);
  [[nodiscard]] Result<> set_exposure(const Order& order);
  [[nodiscard]] bool goes_on(const Order& order, const Error& error) const;
  void note_frame(Result<Frame> frame);
  [[nodiscard]] tl::unexpected<Error> give_up();
  [[nodiscard]] tl::unexpected<Error> fail_not_ready() const;

  std::string name_;
  std::vector<double> exposures_us_;
  bool replays_;
  Backoff backoff_;
  Heartbeat heartbeat_;
  std::atomic<double> rate_hz_{0};
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::unique_ptr<Camera> camera_;  ///< used by the camera's thread; other threads only cancel it, under the mutex
  DeviceStatus status_;
  SequenceGaps gaps_;
  std::optional<Order> order_;
  std::optional<Result<Frame>> answer_;
  std::optional<Replacement> replacement_;  ///< waits for the camera's thread to begin it
  std::uint64_t replacements_ = 0;          ///< the latest replacement; older numbers were abandoned
  std::optional<Result<>> replaced_;        ///< outcome of the last replacement
  bool given_up_ = false;                   ///< the driver exceeded its time; its answer will be dropped
  bool stopped_ = false;
  std::atomic<bool> ended_{false};
  std::jthread thread_;
};

}  // namespace slsd
