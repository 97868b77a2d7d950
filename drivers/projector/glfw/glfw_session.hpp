// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <memory>

#include "core/result.hpp"

struct _XDisplay;

namespace slsd {

/// GLFW from its start to its end, with its connection to the X server, whose loss the process survives.
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
  /// Whether the X server is gone; then the session can only be ended.
  [[nodiscard]] bool lost() const { return lost_; }
  /// Lets GLFW handle what has come; does not wait.
  void handle_events();

 private:
  GlfwSession() = default;

  _XDisplay* display_ = nullptr;
  std::atomic<bool> lost_{false};
};

}  // namespace slsd
