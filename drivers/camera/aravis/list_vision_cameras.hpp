// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/camera/listing/listed_camera.hpp"

namespace slsd {

/// Lists the GigE Vision cameras that answer a broadcast on any network, and the USB3 Vision cameras on this host's
/// buses. Reading the pixel formats of a GigE Vision camera requires its control. Takes control briefly, only of
/// configured cameras that are free: others may belong to somebody else.
/// @param sysfs      "/sys"
/// @param configured  serial number, "vendor-serial" or address; an address is also asked directly, beyond the reach of
///                    broadcasts
/// @thread reentrant
[[nodiscard]] std::vector<ListedCamera> list_vision_cameras(const std::filesystem::path& sysfs,
                                                            const std::vector<std::string>& configured);

}  // namespace slsd
