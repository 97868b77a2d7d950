// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

struct _XDisplay;

namespace slsd {

/// A rectangle of the desktop: from the desktop's upper left corner, x right, y down.
struct DesktopArea {
  int x_px = 0;
  int y_px = 0;
  int width_px = 0;
  int height_px = 0;
  friend bool operator==(const DesktopArea&, const DesktopArea&) = default;
};

[[nodiscard]] constexpr bool overlap(const DesktopArea& a, const DesktopArea& b) {
  return a.x_px < b.x_px + b.width_px && b.x_px < a.x_px + a.width_px && a.y_px < b.y_px + b.height_px &&
         b.y_px < a.y_px + a.height_px;
}

/// A mode that a monitor can be set to.
struct RandrMode {
  unsigned long id = 0;
  int width_px = 0;
  int height_px = 0;
  double refresh_hz = 0.0;
};

/// A connected monitor according to RandR.
struct RandrOutput {
  unsigned long id = 0;
  std::string name;    ///< name of the socket: "HDMI-1"
  std::string model;   ///< model in the monitor's EDID; empty: unknown
  std::string serial;  ///< serial number in the monitor's EDID; empty: none
  bool primary = false;
  bool on = true;         ///< shows a part of the desktop
  DesktopArea area = {};  ///< the shown part of the desktop
  int mode_width_px = 0;  ///< width of the signal
  int mode_height_px = 0;
  int native_width_px = 0;  ///< width of the monitor's preferred mode; 0: unknown
  int native_height_px = 0;
  std::vector<RandrMode> modes = {};  ///< modes that the monitor supports
  double refresh_hz = 0.0;
  int rotation_deg = 0;  ///< 0, 90, 180 or 270
  bool reflected = false;
  bool transformed = false;  ///< the image is scaled or warped before output
  bool gamma_active = false;
  std::string rgb_range;  ///< the property "Broadcast RGB"; empty: the driver has none
  bool underscan = false;

  /// Tells whether it shows a window of a larger area that follows the mouse.
  [[nodiscard]] bool pans() const;
};

enum class Probe {
  kKnown,     ///< what the X server last knew
  kHardware,  ///< makes the server examine its sockets again, which takes up to a second
};

/// The connected monitors, on or off, in RandR's order.
[[nodiscard]] std::vector<RandrOutput> read_outputs(_XDisplay* display, Probe probe = Probe::kKnown);

/// The area that the output shows now. Empty if it is unplugged or off.
[[nodiscard]] std::optional<DesktopArea> lit_area(_XDisplay* display, unsigned long output);

/// Turns a monitor on, or changes its size: sets the mode of that size with the nearest refresh rate. The monitor stays
/// in place unless it would overlap another; then it moves to the right of all others. The desktop grows as needed.
/// @param outputs  all connected monitors
/// @errors kMismatch: no mode of that size; kUnsupported: the X server refuses
[[nodiscard]] Result<> set_output(_XDisplay* display, const RandrOutput& output,
                                  const std::vector<RandrOutput>& outputs, int width_px, int height_px,
                                  double refresh_hz);

/// The mode of that size with the nearest refresh rate; null if there is none.
[[nodiscard]] const RandrMode* find_mode(const RandrOutput& output, int width_px, int height_px, double refresh_hz);

/// The place that has room for the monitor in such a size: its current one, or to the right of all others.
[[nodiscard]] DesktopArea place_of(const RandrOutput& output, const std::vector<RandrOutput>& outputs, int width_px,
                                   int height_px);

/// The monitors of the X server that DISPLAY names, over a separate connection.
/// @errors kNotFound: no X server; kIo: no answer; kUnsupported: no RandR 1.3
/// @thread thread-safe
[[nodiscard]] Result<std::vector<RandrOutput>> list_outputs();

}  // namespace slsd
