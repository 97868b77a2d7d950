// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>

#include "drivers/projector/glfw/display_thread.hpp"
#include "drivers/projector/glfw/projector_screen.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// A projector that is a monitor of an X server: a full-screen window on it, drawn once for each image and not again
/// while that stands still.
///
/// All of GLFW, Xlib and OpenGL runs on one thread, "display", which this class owns. GLFW's documentation asks for the
/// main thread, for the sake of macOS; its X11 code asks only that it is always the same one. Main serves the socket,
/// and a graphics driver may block for long. The thread sleeps until the X server tells something: so an unplugged
/// monitor is known at once, also while nobody scans.
///
/// When the monitor or the X server is gone, open() tries to get it back: the same monitor, never another one unless
/// the options name none and none was found before.
/// @thread thread-bound; one at a time in a process
class GlfwProjector final : public Projector {
 public:
  explicit GlfwProjector(GlfwProjectorOptions options);
  ~GlfwProjector() override;

  /// The monitor is known after open().
  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  /// @errors kNotFound: no X server, or no such monitor; kInvalidArgument: several monitors could be meant; kMismatch:
  /// it
  ///         does not show the projector's size pixel for pixel; kUnsupported: no OpenGL ES 3; kBusy: the process has
  ///         another; kDisconnected
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image) override;
  [[nodiscard]] Result<> check() override;
  [[nodiscard]] std::vector<std::string> warnings() const override { return warnings_; }
  /// A screenshot of the monitor: what other programs draw over the pattern is in it.
  [[nodiscard]] Result<Grey8> read_back() override;

 private:
  GlfwProjectorOptions options_;
  ProjectorDescription description_;
  std::vector<std::string> warnings_;
  ProjectorScreen screen_;  ///< used on the thread alone
  std::atomic<bool> connected_{false};
  DisplayThread thread_;
};

}  // namespace slsd
