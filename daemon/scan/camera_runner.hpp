// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/result.hpp"
#include "daemon/scan/device_status.hpp"
#include "daemon/scan/heartbeat.hpp"
#include "daemon/scan/patience.hpp"
#include "drivers/camera/camera.hpp"

namespace slsd {

/// The choice of the frame that a capture takes.
enum class Exposure {
  kFresh,  ///< the first whose exposure begins after the capture
  kNext,   ///< the one after the last, where the camera runs freely
};

/// Counts frames that are missing between those delivered and that no error has told of.
/// @thread thread-bound
class SequenceGaps {
 public:
  /// The device counts anew.
  void restart() { *this = {}; }
  /// A frame was told to be lost.
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

/// A camera and the thread that it lives on, its supervisor: opens it, opens it again after it was lost, with growing
/// pauses and for ever, looks after it while nobody asks for frames, and takes a frame when told. The first failure and
/// the recovery are logged, not each attempt. docs/supervision.md draws the states.
/// @thread thread-safe, but for the captures, which belong to one thread
class CameraRunner {
 public:
  CameraRunner(std::unique_ptr<Camera> camera, const ScanOptions& options);
  /// Waits for the thread: while a device that is gone is being closed, for seconds.
  ~CameraRunner();
  CameraRunner(const CameraRunner&) = delete;
  CameraRunner& operator=(const CameraRunner&) = delete;

  /// Ends what waits, and the thread, soon. What is asked afterwards fails with kCancelled.
  void request_stop();
  /// Tells whether the thread has ended and the camera is closed.
  [[nodiscard]] bool stopped() const { return ended_; }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] DeviceStatus status() const;
  /// The number of times the camera was opened.
  [[nodiscard]] std::uint64_t openings() const;
  [[nodiscard]] const Heartbeat& heartbeat() const { return heartbeat_; }
  /// Tells whether it replays recorded images.
  [[nodiscard]] bool replays() const { return replays_; }
  /// The frame rate of a camera that runs freely; 0 for any other.
  [[nodiscard]] double rate_hz() const { return rate_hz_; }

  /// Waits until the camera is open.
  /// @errors kTimeout, with the reason why it is not open; kCancelled
  [[nodiscard]] Result<> wait_ready(const Patience& patience);

  /// Puts another camera in the place of this one, with other settings of the same device: closes it, and opens that.
  /// Where the device was open and refuses them, `otherwise` is opened: the same as before, made anew; also
  /// where it takes longer than the deadline. Where it was not open, the other is opened when it can be.
  /// @errors of Camera::open(): why it refuses; kTimeout: its thread did not get to it; kCancelled
  [[nodiscard]] Result<> replace(std::unique_ptr<Camera> next, std::unique_ptr<Camera> otherwise,
                                 MonotonicTime deadline);

  /// Lets the camera expose one frame, now; wait_captured() and end_capture() belong to it.
  void begin_capture(MonotonicTime deadline, Exposure exposure = Exposure::kFresh, Picture light = Picture::kPattern);
  /// Waits for the driver's answer. @return whether it is there, or never will be
  [[nodiscard]] bool wait_captured(const Patience& patience, MonotonicTime until);
  /// Tells a driver that has not answered yet to do so, now.
  void cancel_capture();
  /// Takes the answer. A driver that has none is left alone: it is opened anew when it answers.
  /// @errors as Camera::capture(); kCancelled, kTimeout: it was not ready any more
  [[nodiscard]] Result<Frame> end_capture();

 private:
  struct Order {
    MonotonicTime deadline;
    Exposure exposure = Exposure::kFresh;
    Picture light = Picture::kPattern;
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
  void open_or_pause(const std::stop_token& stop);
  void note_found();
  void note_opened(const Result<>& opened);
  void look_after();
  void note_figures(const std::unique_lock<std::mutex>& lock);
  void note_lost(const Error& error, std::unique_lock<std::mutex> lock);
  [[nodiscard]] std::optional<Order> next_order(const std::stop_token& stop);
  void take_frame(const Order& order);
  [[nodiscard]] bool goes_on(const Order& order, const Error& error) const;
  void note_frame(Result<Frame> frame);
  [[nodiscard]] tl::unexpected<Error> give_up();
  [[nodiscard]] tl::unexpected<Error> fail_not_ready() const;

  std::string name_;
  bool replays_;
  Backoff backoff_;
  Heartbeat heartbeat_;
  std::atomic<double> rate_hz_{0};
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::unique_ptr<Camera> camera_;  ///< used by its thread; from others only to cancel, under the mutex
  DeviceStatus status_;
  SequenceGaps gaps_;
  std::optional<Order> order_;
  std::optional<Result<Frame>> answer_;
  std::optional<Replacement> replacement_;  ///< waits until the camera's thread begins it
  std::uint64_t replacements_ = 0;          ///< begun and given up: one of another number is not awaited
  std::optional<Result<>> replaced_;        ///< outcome of the last replacement
  bool given_up_ = false;                   ///< the driver is over its time; its answer is thrown away
  bool stopped_ = false;
  std::atomic<bool> ended_{false};
  std::jthread thread_;
};

}  // namespace slsd
