// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/opening_warnings.hpp"

namespace slsd {

/// Sets packet size and delay of a GigE Vision camera; nothing for another. To be called before the stream is made.
/// @errors kMismatch, kUnsupported, kDisconnected
[[nodiscard]] Result<> configure_packets(ArvCamera* camera, const AravisCameraOptions& options,
                                         std::vector<NetworkWarning>& warnings);

/// Sets receive buffer and resend of a GigE Vision stream; nothing for another.
void configure_stream(ArvStream* stream, const AravisCameraOptions& options, std::size_t frame_bytes,
                      std::vector<NetworkWarning>& warnings);

}  // namespace slsd
