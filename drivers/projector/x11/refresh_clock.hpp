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

/// The clock of the refreshes of a window's monitor, by the X extension Present over a connection of its own. It takes
/// the vertical blank of the graphics driver, stamped with CLOCK_MONOTONIC. Without Present, it assumes that the
/// refresh begins one period after the buffers were swapped, the latest that is possible.
///
///     prepare()  swap                         wait_refresh() returns t
///     ----|-------|----|-----------------------|-----------------------
///                      the first refresh that  t: its end
///                      shows what was swapped
///
/// A server that flips buffers says itself when it flipped; one that copies has copied before it answers, and the next
/// refresh shows that.
/// @thread thread-bound
class RefreshClock {
 public:
  /// @param window      X id of the window
  /// @param refresh_hz  of its monitor; 0: unknown, 50 is taken
  [[nodiscard]] static std::unique_ptr<RefreshClock> open(const std::string& display, std::uint32_t window,
                                                          double refresh_hz);
  ~RefreshClock();
  RefreshClock(const RefreshClock&) = delete;
  RefreshClock& operator=(const RefreshClock&) = delete;

  /// Tells whether the driver's own times are used.
  [[nodiscard]] bool is_exact() const { return events_ != nullptr; }

  /// Forgets what was before. Called before each swap.
  void prepare();

  /// Waits until the first refresh that shows what was swapped, from its first row on, is complete, and returns when
  /// that was. @errors kDisconnected: no refresh comes
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
