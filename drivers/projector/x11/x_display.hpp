// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "core/result.hpp"

struct _XDisplay;

namespace slsd {

// Xlib ends the process when a request fails or a connection breaks. A service must outlive its X server.

/// Makes failed requests harmless from now on. GLFW undoes this when it creates a window.
/// @thread thread-safe
void survive_x_errors();

/// Sets the flag when this connection ends. Later requests over it do nothing.
/// @param lost  must outlive the connection
void survive_loss(_XDisplay* display, std::atomic<bool>& lost);

/// Makes a call that uses a connection, and jumps out of the call if the connection breaks, because GLFW checks no
/// answer. Resources held by the call are lost.
/// @param call  must hold nothing with a destructor
/// @return      false if the connection broke
[[nodiscard]] bool survive_call(const std::function<void()>& call);

/// The error that no X server answers, with its remedy.
[[nodiscard]] tl::unexpected<Error> no_display();

/// The error kIo that the X server hangs, with its remedy.
[[nodiscard]] tl::unexpected<Error> no_answer();

/// Tells whether only the scanner uses the X server that DISPLAY names, such as that of slsd-display.service. The unit
/// of slsd names a folder in SLSD_OWN_DISPLAY, which exists while that server runs.
[[nodiscard]] bool owns_display();

/// Keeps the monitors of an X server on (DPMS off) while this object lives; then restores power saving.
/// @thread thread-bound
class StayAwake {
 public:
  /// @param display  must outlive this object
  [[nodiscard]] static std::unique_ptr<StayAwake> begin(_XDisplay* display);
  ~StayAwake();
  StayAwake(const StayAwake&) = delete;
  StayAwake& operator=(const StayAwake&) = delete;

 private:
  StayAwake(_XDisplay* display, bool was_enabled) : display_(display), was_enabled_(was_enabled) {}

  _XDisplay* display_;
  bool was_enabled_;
};

}  // namespace slsd
