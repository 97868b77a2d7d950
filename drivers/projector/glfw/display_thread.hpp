// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/projector/glfw/projector_screen.hpp"

namespace slsd {

/// The thread "display" of a projector's screen. Does one piece of work at a time, and otherwise sleeps until the X
/// server sends an event. So it notices an unplugged monitor at once, even while nobody scans.
///
/// Xlib and graphics drivers wait without limit for a hung server. So nobody waits without limit for this thread: late
/// work continues until the server answers or is gone. The thread owns all that it works with. If it is stuck when its
/// owner ends, it is abandoned, and nothing that it uses is freed.
/// @thread one at a time
class DisplayThread {
 public:
  using Work = std::function<void(ProjectorScreen&)>;

  explicit DisplayThread(const GlfwProjectorOptions& options);
  /// Removes the window and ends the thread; a stuck thread does so itself as soon as it can.
  ~DisplayThread();
  DisplayThread(const DisplayThread&) = delete;
  DisplayThread& operator=(const DisplayThread&) = delete;

  /// Starts the thread, unless it already runs. @errors kNoSpace: no descriptor or thread is available
  [[nodiscard]] Result<> start();

  /// Begins the work; earlier work must have ended. @param work  keeps alive what it uses
  void begin(Work work);
  /// Waits for the end of the work. @return whether it ended in time
  [[nodiscard]] bool wait(MonotonicTime until) const;
  /// The start of the current work, or of the last.
  [[nodiscard]] MonotonicTime begun() const;

  /// Tells whether the screen was open when the thread last looked.
  [[nodiscard]] bool screen_open() const;

 private:
  struct Shared;
  static void serve(const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;  // shared: a stuck thread outlives its owner
};

}  // namespace slsd
