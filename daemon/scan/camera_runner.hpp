// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "core/result.hpp"
#include "daemon/scan/backoff.hpp"
#include "daemon/scan/device_status.hpp"
#include "drivers/camera/camera.hpp"

namespace slsd {

/// A camera and the thread that it lives on: opens it, opens it again after it was lost, with growing pauses, and takes
/// a frame when told. The first failure and the recovery are logged, not each attempt.
/// @thread thread-safe, but for begin_capture() and end_capture(), which belong to one thread
class CameraRunner {
 public:
  CameraRunner(std::unique_ptr<Camera> camera, const ScanOptions& options);
  ~CameraRunner();
  CameraRunner(const CameraRunner&) = delete;
  CameraRunner& operator=(const CameraRunner&) = delete;

  /// Ends what waits, and the thread, soon. What is asked afterwards fails with kCancelled.
  void request_stop();

  [[nodiscard]] DeviceStatus status() const;

  /// Waits until the camera is open.
  /// @errors kTimeout, with the reason why it is not open; kCancelled
  [[nodiscard]] Result<> wait_ready(MonotonicTime deadline);

  /// Lets the camera expose one frame, now; end_capture() waits for it.
  void begin_capture(MonotonicTime deadline);
  /// @errors as Camera::capture(); kCancelled
  [[nodiscard]] Result<Frame> end_capture();

 private:
  void run(const std::stop_token& stop);
  void open_or_pause(const std::stop_token& stop);
  void note_opened(const Result<>& opened);
  void note_frame(Result<Frame> frame);
  [[nodiscard]] std::optional<MonotonicTime> next_capture(const std::stop_token& stop);

  std::unique_ptr<Camera> camera_;
  Backoff backoff_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  DeviceStatus status_;
  std::optional<MonotonicTime> asked_;  ///< a capture's deadline
  std::optional<Result<Frame>> answer_;
  bool stopped_ = false;
  std::jthread thread_;
};

}  // namespace slsd
