// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/camera/listing/listed_camera.hpp"

namespace slsd {

/// The GigE Vision cameras that answer, by broadcast on every network, and the USB3 Vision cameras on this host's
/// buses. The pixel formats of a GigE Vision camera cannot be read without its control, which is taken for a moment of
/// those named that are free, and of no other: it might be somebody else's.
/// @param sysfs      "/sys"
/// @param configured  serial number, "vendor-serial" or address; an address is asked also where no broadcast reaches it
/// @thread reentrant
[[nodiscard]] std::vector<ListedCamera> list_vision_cameras(const std::filesystem::path& sysfs,
                                                            const std::vector<std::string>& configured);

}  // namespace slsd
