// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"

struct xcb_connection_t;
struct xcb_special_event;

namespace slsd {

/// Times the refreshes of a window's monitor with the X extension Present, over a separate connection. Uses the
/// graphics driver's vertical blank, stamped with CLOCK_MONOTONIC. Without Present, assumes the latest possible time:
/// the refresh begins one period after the buffers were swapped.
///
///     prepare()  swap                         wait_refresh() returns t
///     ----|-------|----|-----------------------|-----------------------
///                      the first refresh that  t: its end
///                      shows the swapped image
///
/// A server that flips buffers reports when it flipped. A server that copies has finished before it answers, and the
/// next refresh shows the copy.
/// @thread thread-bound
class RefreshClock {
 public:
  /// @param window      X id of the window
  /// @param refresh_hz  of its monitor; 0: unknown, 50 is assumed
  [[nodiscard]] static std::unique_ptr<RefreshClock> open(const std::string& display, std::uint32_t window,
                                                          double refresh_hz);
  ~RefreshClock();
  RefreshClock(const RefreshClock&) = delete;
  RefreshClock& operator=(const RefreshClock&) = delete;

  /// Tells whether the driver's own times are available.
  [[nodiscard]] bool is_exact() const { return events_ != nullptr; }

  /// Discards earlier events. Call it before each swap.
  void prepare();

  /// Waits until the first refresh with the swapped image is complete from its first row on, and returns the time of
  /// its end. @errors kDisconnected: no refresh comes
  [[nodiscard]] Result<MonotonicTime> wait_refresh();

 private:
  struct Refresh {
    std::uint64_t count = 0;
    MonotonicTime begin;
  };
  explicit RefreshClock(double refresh_hz);
  [[nodiscard]] Result<MonotonicTime> wait_begin();
  void connect(const std::string& display, std::uint32_t window);
  [[nodiscard]] std::optional<Refresh> refresh_at(std::uint64_t count, MonotonicTime deadline);
  [[nodiscard]] std::optional<Refresh> next_event(std::uint32_t serial, MonotonicTime deadline);
  [[nodiscard]] bool wait_readable(MonotonicTime deadline);

  std::chrono::nanoseconds period_;
  xcb_connection_t* connection_ = nullptr;
  xcb_special_event* events_ = nullptr;
  std::uint32_t window_ = 0;
  std::uint32_t serial_ = 0;
  std::optional<MonotonicTime> flipped_;
  std::optional<bool> flips_;  ///< whether the server flips; unknown until the first swap
};

}  // namespace slsd
