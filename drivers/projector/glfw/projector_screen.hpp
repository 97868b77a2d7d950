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

/// The keys of the [projector] table that a projector on a monitor reads.
struct GlfwProjectorOptions {
  std::string monitor = {};  ///< see choose_output()
  int width_px = 1280;       ///< 1 to 16384; the monitor's
  int height_px = 800;       ///< 1 to 16384; the monitor's
  LightOptions light = {};
  bool enable_output = false;  ///< turn the monitor on and set it to that size: the display is the scanner's alone
  double refresh_hz = 60.0;    ///< then at the nearest refresh that it has

  [[nodiscard]] Result<> validate() const;
};

/// A full-screen window on the projector's monitor and all that it needs, from open() until the monitor is unplugged,
/// is turned off or changes its place or size, or the X server ends.
/// @thread thread-bound
class ProjectorScreen {
 public:
  explicit ProjectorScreen(GlfwProjectorOptions options) : options_(std::move(options)) {}

  /// Ends what is open, opens anew and shows black. @errors as Projector::open()
  [[nodiscard]] Result<> open();
  /// Takes the window away.
  void close();
  /// Also leaves the X server.
  void end();

  /// @param image  of the projector's size @errors kDisconnected
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image);
  /// The projector's part of the desktop, as a screenshot. @errors kDisconnected
  [[nodiscard]] Result<Grey8> read_back();

  /// Handles what the X server tells. @return what to wait on for more, -1: nothing
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
  MonotonicTime probed_{};  ///< time when the X server last looked for monitors at our wish
  std::unique_ptr<FullscreenWindow> window_;
  std::optional<TexelPainter> painter_;
  std::unique_ptr<RefreshClock> clock_;
  bool swapped_ = false;  ///< and nobody waited for it
};

}  // namespace slsd
