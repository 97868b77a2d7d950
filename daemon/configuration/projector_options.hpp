// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

enum class ProjectorDriver { kHeadless, kGlfw };
[[nodiscard]] std::string_view to_string(ProjectorDriver driver);

/// The [projector] table.
struct ProjectorOptions {
  ProjectorDriver driver = ProjectorDriver::kHeadless;
  std::string monitor;  ///< name or EDID serial; empty: the monitor that is not the primary
  int width_px = 1280;  ///< 640 to 3840
  int height_px = 800;  ///< 360 to 2160

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const ProjectorOptions&, const ProjectorOptions&) = default;
};

}  // namespace slsd
