// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "core/shown_picture.hpp"
#include "drivers/projector/light_curve.hpp"

namespace slsd {

enum class ProjectorDriver { kHeadless, kGlfw };
[[nodiscard]] std::string_view to_string(ProjectorDriver driver);

/// The [projector] table.
struct ProjectorOptions {
  ProjectorDriver driver = ProjectorDriver::kHeadless;
  std::string monitor;  ///< name, EDID serial or place on the desktop; empty: the monitor that is not primary
  int width_px = 1280;  ///< 640 to 3840
  int height_px = 800;  ///< 360 to 2160
  LightOptions light;   ///< conversion of grey levels to light
  /// Turns the monitor on and sets that size if no other program does; unset: if the scanner alone uses the display.
  std::optional<bool> enable_output;
  double refresh_hz = 60.0;          ///< 10 to 1000; 0: the light is steady, so that every exposure suits it
  Picture idle = Picture::kPattern;  ///< shown when nobody has scanned for a while: kPattern, kBlack or kWhite
  int idle_after_ms = 2000;          ///< 0 to 3600000; delay between a scan and the idle picture

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const ProjectorOptions&, const ProjectorOptions&) = default;
};

}  // namespace slsd
