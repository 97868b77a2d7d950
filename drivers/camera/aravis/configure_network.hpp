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

  /// Tells whether the address is in its network, so that it is reached without a router.
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

/// Something about the system that may cost frames, or that could not be made sure of, by name and with what to do.
struct NetworkWarning {
  std::string name;  ///< "receive_buffer", "packet_size", "packet_socket", "fragments", "packet_resend",
                     ///< "device_clock", "chunks" or "first_frame"
  std::string advice;
};

/// The camera's clock is of no use. @param fault  "cannot be read"
[[nodiscard]] NetworkWarning device_clock_warning(std::string_view fault);
/// The chunks of the first frames could not be read.
[[nodiscard]] NetworkWarning chunks_warning();
/// The camera can be made to expose by no means that this host has.
[[nodiscard]] NetworkWarning first_frame_warning();

/// The warning about packets that are small for large frames, with its remedy.
/// @param interface  of this host to the camera, as far as it is known
[[nodiscard]] NetworkWarning packet_size_warning(unsigned packet_bytes, const std::optional<HostInterface>& interface);

/// The warning about packets that arrive in pieces, with its remedy.
/// @param packet_bytes  that were set; 0: the camera's packets were tried
[[nodiscard]] NetworkWarning fragments_warning(int packet_bytes, const std::optional<HostInterface>& interface);

/// Each packet socket heard other devices before it was narrowed to the camera.
/// @param interface  of this host to the camera, as far as it is known
[[nodiscard]] NetworkWarning packet_socket_warning(const std::optional<HostInterface>& interface);

/// The interface of this host to the camera, as far as it is known. Empty for a camera that is not GigE Vision.
[[nodiscard]] std::optional<HostInterface> interface_of(ArvCamera* camera);

/// Sets packet size and delay of a GigE Vision camera; nothing for another. To be called before the stream is made.
/// @errors kMismatch, kUnsupported, kDisconnected
[[nodiscard]] Result<> configure_packets(ArvCamera* camera, const AravisCameraOptions& options,
                                         std::vector<NetworkWarning>& warnings);

/// Has streams of a GigE Vision camera take packets before the UDP socket, or not. To be called before they are made.
void choose_socket(ArvCamera* camera, const AravisCameraOptions& options);
/// Tells whether this stream takes packets before the UDP socket.
[[nodiscard]] bool takes_packet_socket(ArvStream* stream, const AravisCameraOptions& options);

/// Sets receive buffer and resend of a GigE Vision stream; nothing for another.
void configure_stream(ArvStream* stream, const AravisCameraOptions& options, std::size_t frame_bytes,
                      std::vector<NetworkWarning>& warnings);

}  // namespace slsd
