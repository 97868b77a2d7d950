// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/projector/glfw/projector_screen.hpp"

namespace slsd {

/// The thread that a projector's screen lives on, "display". It does one piece of work at a time, and in between sleeps
/// until the X server tells something: so an unplugged monitor is known at once, also while nobody scans.
///
/// Xlib and graphics drivers wait for a server that hangs without bound. So nobody waits for this thread without bound:
/// work that is not done in time goes on, until the server answers or is gone. The thread owns all that it works with;
/// where it is stuck when its owner ends, it is left to itself and nothing is freed under it.
/// @thread one at a time
class DisplayThread {
 public:
  using Work = std::function<void(ProjectorScreen&)>;

  explicit DisplayThread(const GlfwProjectorOptions& options);
  /// Takes the window away and ends the thread; one that is stuck does so itself, as soon as it can.
  ~DisplayThread();
  DisplayThread(const DisplayThread&) = delete;
  DisplayThread& operator=(const DisplayThread&) = delete;

  /// Starts the thread, unless it runs already. @errors kNoSpace: no descriptor or no thread is left
  [[nodiscard]] Result<> start();

  /// Begins the work; what came before has ended. @param work  keeps alive what it uses
  void begin(Work work);
  /// Waits for the end of the work. @return whether it has ended, by the time
  [[nodiscard]] bool wait(MonotonicTime until) const;
  /// The start of the work under way, or of the last.
  [[nodiscard]] MonotonicTime begun() const;

  /// Tells whether the screen was open when the thread last looked.
  [[nodiscard]] bool screen_open() const;

 private:
  struct Shared;
  static void serve(const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;  // shared: a thread that is stuck outlives its owner
};

}  // namespace slsd
