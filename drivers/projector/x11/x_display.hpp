// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "core/result.hpp"

struct _XDisplay;

namespace slsd {

// Xlib ends the process when a request fails or a connection breaks. A service outlives its X server.

/// Makes a request that fails do nothing, from now on. GLFW undoes this when it makes a window.
/// @thread thread-safe
void survive_x_errors();

/// Makes the end of this connection set the flag, from now on. Later requests over it do nothing.
/// @param lost  outlives the connection
void survive_loss(_XDisplay* display, std::atomic<bool>& lost);

/// Makes a call that uses a connection, and comes back from the midst of it when that breaks: GLFW looks at no answer.
/// What the call holds by then is lost.
/// @param call  nothing in it has a destructor
/// @return      false where the connection broke
[[nodiscard]] bool survive_call(const std::function<void()>& call);

/// The error that no X server answers, with its remedy.
[[nodiscard]] tl::unexpected<Error> no_display();

/// The error kIo that the X server hangs, with its remedy.
[[nodiscard]] tl::unexpected<Error> no_answer();

/// Tells whether the X server that DISPLAY names belongs to the scanner alone, as that of slsd-display.service does.
/// The unit of slsd says so by the folder that SLSD_OWN_DISPLAY names, which is there while that server runs.
[[nodiscard]] bool owns_display();

/// Keeps the monitors of an X server lit (DPMS off) for as long as it lives; then power saving is as it was.
/// @thread thread-bound
class StayAwake {
 public:
  /// @param display  outlives it
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
