// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/result.hpp"
#include "drivers/projector/glfw/glfw_session.hpp"
#include "drivers/projector/x11/randr_output.hpp"

struct GLFWwindow;

namespace slsd {

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
  /// Whether it is on the screen, exactly there; asks the X server.
  [[nodiscard]] bool covers(const DesktopArea& area) const;
  /// Called when what was shown is damaged and has to be drawn anew.
  void set_redraw(std::function<void()> redraw) { redraw_ = std::move(redraw); }
  /// Shows what was drawn; returns when the X server has it.
  void swap();

 private:
  explicit FullscreenWindow(GlfwSession& session) : session_(session) {}
  [[nodiscard]] bool wait_until_it_covers(unsigned long output, int width_px, int height_px);

  GlfwSession& session_;
  GLFWwindow* window_ = nullptr;
  std::function<void()> redraw_;
};

}  // namespace slsd
