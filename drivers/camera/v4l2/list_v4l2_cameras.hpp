// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/camera/listing/listed_camera.hpp"

namespace slsd {

/// The cameras among a folder's videoN, in the order of their numbers, named as in its v4l/by-id where they are there.
/// None is disturbed in what it does.
/// @param devices  "/dev"
/// @param sysfs    "/sys"
/// @param more     other device nodes to look at, as the configuration names them
[[nodiscard]] std::vector<ListedCamera> list_v4l2_cameras(const std::filesystem::path& devices,
                                                          const std::filesystem::path& sysfs,
                                                          const std::vector<std::filesystem::path>& more);

}  // namespace slsd
