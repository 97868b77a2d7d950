// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/projector/glfw/display_thread.hpp"
#include "drivers/projector/glfw/projector_screen.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// A projector connected as a monitor of an X server. Shows a full-screen window, drawn once for each image and not
/// redrawn while the image stays.
///
/// GLFW, Xlib and OpenGL all run on one thread, which this class owns. GLFW's documentation requires the main thread
/// because of macOS; its X11 code only requires the same thread each time. The main thread serves the socket, and a
/// graphics driver may block for long.
///
/// If the monitor or the X server is gone, open() tries to find the same monitor again. It takes another one only if
/// the options name none and none was found before. A hung X server blocks the thread until it continues or ends.
/// Meanwhile every call reports that at once; then the projector continues.
/// @thread thread-bound; one at a time in a process
class GlfwProjector final : public Projector {
 public:
  explicit GlfwProjector(GlfwProjectorOptions options);

  /// The monitor becomes known in open().
  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  /// @errors kNotFound: no X server, or no such monitor; kInvalidArgument: several monitors match; kMismatch: the
  ///         monitor does not show the projector's size pixel for pixel; kUnsupported: no OpenGL ES 3; kBusy: the
  ///         process has another; kDisconnected; kIo: the X server hangs; kTimeout
  [[nodiscard]] Result<> open(MonotonicTime deadline) override;
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) override;
  [[nodiscard]] Result<> check(MonotonicTime deadline) override;
  [[nodiscard]] std::vector<std::string> warnings() const override { return warnings_; }
  /// Takes a screenshot of the monitor, including what other programs draw over the pattern.
  [[nodiscard]] Result<Grey8> read_back() override;

 private:
  /// The thread's last order and its outcome, until somebody fetches the outcome.
  struct Order {
    enum class Task { kOpen, kShow, kCheck, kReadBack } task;
    Grey8 image = {};  ///< the image to show
    Result<> opened = {};
    RandrOutput output = {};
    std::vector<std::string> warnings = {};
    Result<MonotonicTime> shown = {};
    Result<Grey8> screenshot = {};
  };
  using Task = Order::Task;
  [[nodiscard]] bool is_under_way(Task task) const { return order_ && order_->task == task; }
  [[nodiscard]] Result<> begin(Order order, MonotonicTime deadline, void (*work)(ProjectorScreen&, Order&));
  [[nodiscard]] Result<> wait(MonotonicTime deadline) const;
  [[nodiscard]] tl::unexpected<Error> fail_gone() const;
  [[nodiscard]] std::string where() const;

  GlfwProjectorOptions options_;
  ProjectorDescription description_;
  std::vector<std::string> warnings_;
  std::shared_ptr<Order> order_;  // shared with the thread, which may outlive this object
  DisplayThread thread_;
};

}  // namespace slsd
