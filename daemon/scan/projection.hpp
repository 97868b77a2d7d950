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
#include "daemon/scan/device_status.hpp"
#include "daemon/scan/patience.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// The projector and what it shows. Opens it, opens it again after it was lost, with growing pauses; the first failure
/// and the recovery are logged, not each attempt. Comes back from every call in time, whatever the projector does.
///
///             a scan                    idle_after without a scan
///     any ------------> pattern (white, black) ------------> idle picture
///      |                   ^
///      +--hold()--> held --+ a scan, or release()
///
/// @thread thread-bound, but for status()
class Projection {
 public:
  /// @param pattern  of the projector's size
  Projection(std::unique_ptr<Projector> projector, Grey8 pattern, const ScanOptions& options);

  /// Sets the pattern of the scans from the next one on.
  void set_pattern(Grey8 pattern);
  /// Sets the picture shown when nobody has scanned for a while. Without a picture the pattern stays.
  void set_idle(std::optional<Grey8> picture, std::chrono::milliseconds after);

  /// Shows a picture until a scan, another hold() or release(); returns when it is visible.
  /// @param picture  nothing: the pattern
  /// @errors as show(); what was held before then still is
  [[nodiscard]] Result<> hold(std::optional<Grey8> picture, MonotonicTime deadline, const std::stop_token& stop);
  /// Goes on to the idle picture, at once. @errors as hold()
  [[nodiscard]] Result<> release(MonotonicTime deadline, const std::stop_token& stop);

  /// Opens the projector and shows what is due; notices that it is gone, or hangs. Takes a tenth of a second at most:
  /// what takes longer goes on, and the next call looks after it.
  void supervise();
  /// The time when supervise() next changes the picture; the end of time if it will not.
  [[nodiscard]] MonotonicTime next_change() const;

  /// Returns when the picture is visible, whatever was shown before.
  /// @param picture  the pattern, and for the light of each point all white and all black
  /// @errors kTimeout, with the reason; kCancelled
  [[nodiscard]] Result<> show(Picture picture, MonotonicTime deadline, const std::stop_token& stop);
  /// Returns when what is due is visible. @errors as show()
  [[nodiscard]] Result<> show_due(MonotonicTime deadline, const std::stop_token& stop);

  /// Checks that what was shown still is. Called after each capture. Returns 0.3 s after the deadline, or after now, at
  /// the latest. @errors kDisconnected
  [[nodiscard]] Result<> check(MonotonicTime deadline);
  /// The time from which every exposure sees the current picture alone, and nothing of the one before.
  [[nodiscard]] MonotonicTime visible() const { return visible_; }
  /// The number of picture changes. Frames of different counts do not belong together.
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
  Grey8 plain_;  ///< white or black, kept for its memory
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
  bool looking_ = false;  ///< whether it is still shown, it has not answered yet
  std::uint64_t changes_ = 0;
  mutable std::mutex mutex_;  ///< guards status_
  DeviceStatus status_;
};

}  // namespace slsd
