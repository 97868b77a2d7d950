// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/projector/glfw/glfw_window.hpp"
#include "drivers/projector/light_curve.hpp"
#include "drivers/projector/projector.hpp"
#include "drivers/projector/texel_painter.hpp"
#include "drivers/projector/x11/refresh_clock.hpp"

namespace slsd {

/// The keys of the [projector] table for a projector on a monitor.
struct GlfwProjectorOptions {
  std::string monitor = {};  ///< see choose_output()
  int width_px = 1280;       ///< 1 to 16384; equal to the monitor's
  int height_px = 800;       ///< 1 to 16384; equal to the monitor's
  LightOptions light = {};
  bool enable_output = false;  ///< turn the monitor on and set that size: the scanner alone uses the display
  double refresh_hz = 60.0;    ///< then at the monitor's nearest refresh rate

  [[nodiscard]] Result<> validate() const;
};

/// A full-screen window on the projector's monitor, with all that it needs. Lasts from open() until the X server ends,
/// or the monitor is unplugged, turned off, moved or resized.
/// @thread thread-bound
class ProjectorScreen {
 public:
  explicit ProjectorScreen(GlfwProjectorOptions options) : options_(std::move(options)) {}

  /// Closes an open window, opens a new one and shows black. @errors as Projector::open()
  [[nodiscard]] Result<> open();
  /// Removes the window.
  void close();
  /// Also disconnects from the X server.
  void end();

  /// @param image  in the projector's size @errors kDisconnected
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image);
  /// Takes a screenshot of the projector's part of the desktop. @errors kDisconnected
  [[nodiscard]] Result<Grey8> read_back();

  /// Handles the X server's events. @return the descriptor to wait on for more, -1: none
  int handle_events();

  [[nodiscard]] bool is_open() const { return window_ != nullptr; }
  [[nodiscard]] const RandrOutput& output() const { return output_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  [[nodiscard]] Result<> open_session();
  [[nodiscard]] Result<> find_output();
  [[nodiscard]] Result<RandrOutput> enabled_output();
  [[nodiscard]] Result<> open_window();
  [[nodiscard]] Result<> check_open() const;
  [[nodiscard]] bool is_in_place() const;
  void redraw();
  void settle();

  GlfwProjectorOptions options_;
  RandrOutput output_;
  std::vector<std::string> warnings_;
  std::unique_ptr<GlfwSession> session_;
  MonotonicTime probed_{};  ///< time when this last made the X server look for monitors
  std::unique_ptr<FullscreenWindow> window_;
  std::optional<TexelPainter> painter_;
  std::unique_ptr<RefreshClock> clock_;
  bool swapped_ = false;  ///< set if nobody has waited for the swap yet
};

}  // namespace slsd
