// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "core/image.hpp"
#include "core/result.hpp"
#include "core/shown_picture.hpp"
#include "daemon/scan/rig/device_status.hpp"
#include "daemon/scan/wait_limit.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// The projector and what it shows. Opens the projector, and reopens it when lost, with growing pauses. Logs the first
/// failure and the recovery, not each attempt. Every call returns in time, whatever the projector does.
///
///             a scan                    idle_after without a scan
///     any ------------> pattern (white, black) ------------> idle picture
///      |                   ^
///      +--hold()--> held --+ a scan, or release()
///
/// @thread thread-bound, except status()
class Projection {
 public:
  /// @param pattern  in the projector's size
  Projection(std::unique_ptr<Projector> projector, Grey8 pattern, const ScanOptions& options);

  /// Sets the pattern for the next scans.
  void set_pattern(Grey8 pattern);
  /// Sets the picture shown when nobody has scanned for a while. Without a picture the pattern stays.
  void set_idle(std::optional<Grey8> picture, std::chrono::milliseconds after);

  /// Shows a picture until a scan, another hold() or release(). Returns when the picture is visible.
  /// @param picture  nothing: the pattern
  /// @errors as show(); the previously held picture then stays
  [[nodiscard]] Result<> hold(std::optional<Grey8> picture, MonotonicTime deadline, const std::stop_token& stop);
  /// Returns to the idle picture at once. @errors as hold()
  [[nodiscard]] Result<> release(MonotonicTime deadline, const std::stop_token& stop);

  /// Opens the projector and shows the current picture; notices a lost or hung projector. Takes at most a tenth of a
  /// second. Slower work continues, and the next call checks it.
  void supervise();
  /// The time when supervise() next changes the picture; the end of time if never.
  [[nodiscard]] MonotonicTime next_change() const;

  /// Shows a picture, whatever was shown before. Returns when it is visible.
  /// @param picture  the pattern, or all white or all black to measure the light of each point
  /// @errors kTimeout, with the reason; kCancelled
  [[nodiscard]] Result<> show(Picture picture, MonotonicTime deadline, const std::stop_token& stop);
  /// Shows the picture that is due now. Returns when it is visible. @errors as show()
  [[nodiscard]] Result<> show_due(MonotonicTime deadline, const std::stop_token& stop);

  /// Checks that the picture is still shown. Called after each capture. Returns at most 0.3 s after the deadline, or
  /// after now if that is later. @errors kDisconnected
  [[nodiscard]] Result<> check(MonotonicTime deadline);
  /// The time from which every exposure sees only the current picture, and nothing of the one before.
  [[nodiscard]] MonotonicTime visible() const { return visible_; }
  /// The number of picture changes. Frames belong together only if their counts are equal.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }

  /// @thread thread-safe
  [[nodiscard]] DeviceStatus status() const;

 private:
  struct Held {
    std::optional<Grey8> picture;  ///< nothing: the pattern
  };
  [[nodiscard]] Picture due() const;
  [[nodiscard]] const Grey8& image(Picture which);
  [[nodiscard]] Result<> open_and_show(Picture which, MonotonicTime until);
  [[nodiscard]] Result<> await(Picture which, MonotonicTime deadline, const std::stop_token& stop);
  [[nodiscard]] Result<> show_held(std::optional<Held> held, MonotonicTime deadline, const std::stop_token& stop);
  void set_held(std::optional<Held> held);
  [[nodiscard]] tl::unexpected<Error> fail_not_ready() const;
  [[nodiscard]] bool look(MonotonicTime until);
  void attempt(Picture which, MonotonicTime until);
  void lose(const Result<>& reason);
  void note(const Result<>& outcome);

  std::unique_ptr<Projector> projector_;
  Grey8 pattern_;
  Grey8 plain_;  ///< white or black; kept to reuse its memory
  std::optional<Grey8> idle_;
  std::optional<Held> held_;
  std::chrono::milliseconds idle_after_{0};
  std::chrono::microseconds latency_;
  Backoff backoff_;
  MonotonicTime next_attempt_{};
  MonotonicTime last_scan_{};
  MonotonicTime visible_{};
  std::optional<Picture> shown_;  ///< nothing: unknown
  bool open_ = false;
  bool looking_ = false;  ///< still waits for the answer whether the picture is shown
  std::uint64_t changes_ = 0;
  mutable std::mutex mutex_;  ///< guards status_
  DeviceStatus status_;
};

}  // namespace slsd
