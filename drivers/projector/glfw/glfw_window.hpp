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

/// GLFW from its start to its end, with its connection to the X server. The process survives the loss of that
/// connection. The server's monitors stay awake.
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
  /// Tells whether the X server is gone; then only the destructor may follow.
  [[nodiscard]] bool lost() const { return lost_; }
  /// Lets GLFW handle pending events; does not wait.
  void handle_events();

 private:
  GlfwSession() = default;

  _XDisplay* display_ = nullptr;
  std::atomic<bool> lost_{false};
  std::unique_ptr<StayAwake> awake_;
};

/// A window over one whole monitor. Its OpenGL ES 3 context is current on this thread while the window lives. Hides the
/// pointer and blocks the screen saver.
/// @thread thread-bound
class FullscreenWindow {
 public:
  /// @param session  must outlive the window
  /// @param output   the monitor. Its mode changes only if the requested size is its native one and not in use
  /// @errors kNotFound: the monitor has disappeared; kUnsupported: no OpenGL ES 3; kMismatch: the window does not get
  ///         the whole monitor
  [[nodiscard]] static Result<std::unique_ptr<FullscreenWindow>> open(GlfwSession& session, const RandrOutput& output,
                                                                      int width_px, int height_px);
  ~FullscreenWindow();
  FullscreenWindow(const FullscreenWindow&) = delete;
  FullscreenWindow& operator=(const FullscreenWindow&) = delete;

  [[nodiscard]] std::uint32_t id() const;
  /// Tells whether the window is on the screen at exactly that place; asks the X server.
  [[nodiscard]] bool covers(const DesktopArea& area) const;
  /// Tells whether the window was damaged since the last call and must be redrawn.
  [[nodiscard]] bool take_damage() { return std::exchange(damaged_, false); }
  /// Shows the drawn image; returns when the X server has it.
  void swap();

 private:
  explicit FullscreenWindow(GlfwSession& session) : session_(session) {}
  [[nodiscard]] bool wait_until_it_covers(unsigned long output, int width_px, int height_px);

  GlfwSession& session_;
  GLFWwindow* window_ = nullptr;
  bool damaged_ = false;
};

}  // namespace slsd
