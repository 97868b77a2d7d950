// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"

using ArvCamera = struct _ArvCamera;
using ArvStream = struct _ArvStream;

namespace slsd {

/// An interface of this host that is up and has an IPv4 address.
struct HostInterface {
  std::string name;     ///< "eth1"
  in_addr address{};    ///< in network byte order
  in_addr mask{};       ///< in network byte order
  unsigned number = 0;  ///< the kernel's index
  std::optional<int> link_mbps = {};
  std::optional<int> mtu_bytes = {};

  /// Tells whether the address is in the interface's network, reachable without a router.
  [[nodiscard]] bool reaches(in_addr other) const;
  /// "eth1 (10.0.0.1/24)"
  [[nodiscard]] std::string text() const;
};

/// The interfaces of this host, one for each address.
[[nodiscard]] std::vector<HostInterface> list_host_interfaces();

/// "10.0.0.1"
[[nodiscard]] std::string address_text(in_addr address);

/// Tells whether this process may take packets before the UDP socket (CAP_NET_RAW).
/// @thread reentrant
[[nodiscard]] bool packet_socket_allowed();

/// A system property that may cost frames, or could not be verified: its name and the remedy.
struct NetworkWarning {
  std::string name;  ///< "receive_buffer", "packet_size", "packet_socket", "fragments", "packet_resend",
                     ///< "device_clock", "chunks" or "first_frame"
  std::string advice;
};

/// The warning that the camera's clock cannot be used. @param fault  "cannot be read"
[[nodiscard]] NetworkWarning device_clock_warning(std::string_view fault);
/// The warning that the chunks of the first frames could not be read.
[[nodiscard]] NetworkWarning chunks_warning();
/// The warning that this host has no way to trigger the camera.
[[nodiscard]] NetworkWarning first_frame_warning();

/// The warning that packets are small for large frames, with the remedy.
/// @param interface  of this host to the camera, if known
[[nodiscard]] NetworkWarning packet_size_warning(unsigned packet_bytes, const std::optional<HostInterface>& interface);

/// The warning that packets arrive in fragments, with the remedy.
/// @param packet_bytes  the configured size; 0: the camera's own size was tried
[[nodiscard]] NetworkWarning fragments_warning(int packet_bytes, const std::optional<HostInterface>& interface);

/// The warning that each packet socket heard other devices before its filter was set.
/// @param interface  of this host to the camera, if known
[[nodiscard]] NetworkWarning packet_socket_warning(const std::optional<HostInterface>& interface);

/// The interface of this host to the camera, if known. Empty for a camera that is not GigE Vision.
[[nodiscard]] std::optional<HostInterface> interface_of(ArvCamera* camera);

/// Sets packet size and delay of a GigE Vision camera; does nothing for others. Call it before making the stream.
/// @errors kMismatch, kUnsupported, kDisconnected
[[nodiscard]] Result<> configure_packets(ArvCamera* camera, const AravisCameraOptions& options,
                                         std::vector<NetworkWarning>& warnings);

/// Chooses whether streams of a GigE Vision camera take packets before the UDP socket. Call it before making them.
void choose_socket(ArvCamera* camera, const AravisCameraOptions& options);
/// Tells whether this stream takes packets before the UDP socket.
[[nodiscard]] bool takes_packet_socket(ArvStream* stream, const AravisCameraOptions& options);

/// Sets receive buffer and resend of a GigE Vision stream; does nothing for others.
void configure_stream(ArvStream* stream, const AravisCameraOptions& options, std::size_t frame_bytes,
                      std::vector<NetworkWarning>& warnings);

}  // namespace slsd
