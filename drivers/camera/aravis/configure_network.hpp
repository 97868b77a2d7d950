// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// Something about the system that may cost frames, or that could not be made sure of, by name and with what to do.
struct NetworkWarning {
  std::string name;  ///< "receive_buffer", "packet_size", "packet_resend", "device_clock", "chunks" or "first_frame"
  std::string advice;
};

/// Sets packet size and delay of a GigE Vision camera; nothing for another. To be called before the stream is made.
/// @errors kMismatch, kUnsupported, kDisconnected
[[nodiscard]] Result<> configure_packets(ArvCamera* camera, const AravisCameraOptions& options,
                                         std::vector<NetworkWarning>& warnings);

/// Sets receive buffer and resend of a GigE Vision stream; nothing for another.
void configure_stream(ArvStream* stream, const AravisCameraOptions& options, std::size_t frame_bytes,
                      std::vector<NetworkWarning>& warnings);

}  // namespace slsd
