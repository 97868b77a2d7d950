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

/// A monitor that shows a part of the desktop, as RandR tells of it.
struct RandrOutput {
  unsigned long id = 0;
  std::string name;    ///< of the socket: "HDMI-1"
  std::string model;   ///< as the monitor's EDID says; empty: unknown
  std::string serial;  ///< as the monitor's EDID says; empty: none
  bool primary = false;
  DesktopArea area;
  int mode_width_px = 0;  ///< of the signal
  int mode_height_px = 0;
  int native_width_px = 0;  ///< of the mode that the monitor prefers; 0: it does not say
  int native_height_px = 0;
  double refresh_hz = 0.0;
  int rotation_deg = 0;  ///< 0, 90, 180 or 270
  bool reflected = false;
  bool transformed = false;  ///< scaled or warped on its way to the signal
  bool gamma_active = false;
  std::string rgb_range;  ///< the property "Broadcast RGB"; empty: the driver does not say
  bool underscan = false;
};

/// The monitors that are plugged in and lit, in RandR's order.
[[nodiscard]] std::vector<RandrOutput> read_outputs(_XDisplay* display);

/// Where that output is lit now; nothing where it is unplugged or off.
[[nodiscard]] std::optional<DesktopArea> lit_area(_XDisplay* display, unsigned long output);

/// The monitors of the X server that DISPLAY names, over a connection of its own.
/// @errors kNotFound: no X server answers; kUnsupported: it lacks RandR 1.3
/// @thread thread-safe
[[nodiscard]] Result<std::vector<RandrOutput>> list_outputs();

}  // namespace slsd
