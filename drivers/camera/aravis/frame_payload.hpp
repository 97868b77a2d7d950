// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/aravis/configure_chunks.hpp"
#include "drivers/camera/aravis/configure_device.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// How many bytes the camera sends for a frame: those of the image, and of the chunks if some are on. To be asked after
/// everything else is set, which might change it.
/// @errors kMismatch: it is not what the configuration makes; kUnsupported, kDisconnected
[[nodiscard]] Result<std::size_t> read_payload_bytes(ArvCamera* camera, const DeviceLayout& layout,
                                                     const ChunkSelection& chunks);

}  // namespace slsd
