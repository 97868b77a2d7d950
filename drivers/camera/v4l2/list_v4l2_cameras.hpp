// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/camera/listing/listed_camera.hpp"

namespace slsd {

/// Lists the cameras among a folder's videoN nodes, in the order of their numbers. Uses their names in its v4l/by-id if
/// present. Does not disturb cameras in use.
/// @param devices  "/dev"
/// @param sysfs    "/sys"
/// @param more     more device nodes, as the configuration names them
[[nodiscard]] std::vector<ListedCamera> list_v4l2_cameras(const std::filesystem::path& devices,
                                                          const std::filesystem::path& sysfs,
                                                          const std::vector<std::filesystem::path>& more);

}  // namespace slsd
