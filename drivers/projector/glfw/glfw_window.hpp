// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/result.hpp"
#include "drivers/projector/x11/randr_output.hpp"
#include "drivers/projector/x11/x_display.hpp"

struct GLFWwindow;
struct _XDisplay;

namespace slsd {

/// GLFW from its start to its end, with its connection to the X server, whose loss the process survives and whose
/// monitors stay awake.
/// @thread thread-bound; one at a time in a process
class GlfwSession {
 public:
  /// @errors kNotFound: no display; kBusy: the process has a session already
  [[nodiscard]] static Result<std::unique_ptr<GlfwSession>> open();
  ~GlfwSession();
  GlfwSession(const GlfwSession&) = delete;
  GlfwSession& operator=(const GlfwSession&) = delete;

  [[nodiscard]] _XDisplay* display() const { return display_; }
  /// Readable when there are events.
  [[nodiscard]] int descriptor() const;
  /// Tells whether the X server is gone; then the session can only be ended.
  [[nodiscard]] bool lost() const { return lost_; }
  /// Lets GLFW handle what has come; does not wait.
  void handle_events();

 private:
  GlfwSession() = default;

  _XDisplay* display_ = nullptr;
  std::atomic<bool> lost_{false};
  std::unique_ptr<StayAwake> awake_;
};

/// A window over one whole monitor, with a context of OpenGL ES 3 that is current on this thread while it lives; no
/// pointer on it, no screen saver.
/// @thread thread-bound
class FullscreenWindow {
 public:
  /// @param session  outlives it
  /// @param output   where; its mode is changed only where the size asked for is its native one and not that in use
  /// @errors kNotFound: that monitor has gone meanwhile; kUnsupported: no OpenGL ES 3; kMismatch: the window does not
  ///         get the whole monitor
  [[nodiscard]] static Result<std::unique_ptr<FullscreenWindow>> open(GlfwSession& session, const RandrOutput& output,
                                                                      int width_px, int height_px);
  ~FullscreenWindow();
  FullscreenWindow(const FullscreenWindow&) = delete;
  FullscreenWindow& operator=(const FullscreenWindow&) = delete;

  [[nodiscard]] std::uint32_t id() const;
  /// Tells whether it is on the screen, exactly there; asks the X server.
  [[nodiscard]] bool covers(const DesktopArea& area) const;
  /// Tells whether what was shown was damaged since the last call, and has to be drawn anew.
  [[nodiscard]] bool take_damage() { return std::exchange(damaged_, false); }
  /// Shows what was drawn; returns when the X server has it.
  void swap();

 private:
  explicit FullscreenWindow(GlfwSession& session) : session_(session) {}
  [[nodiscard]] bool wait_until_it_covers(unsigned long output, int width_px, int height_px);

  GlfwSession& session_;
  GLFWwindow* window_ = nullptr;
  bool damaged_ = false;
};

}  // namespace slsd
