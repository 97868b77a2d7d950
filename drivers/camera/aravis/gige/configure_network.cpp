// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige/configure_network.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>

#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/listing/sysfs.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {
namespace {

in_addr ipv4_of(const sockaddr* address) {
  return reinterpret_cast<const sockaddr_in*>(address)->sin_addr;
}

std::optional<int> mtu(const std::string& name) {
  return first_number(std::filesystem::path("/sys/class/net") / name / "mtu");
}

// The kernel returns -1 if a link has no speed, such as the loopback.
std::optional<int> link_speed(const std::string& name) {
  const auto speed = first_number(std::filesystem::path("/sys/class/net") / name / "speed");
  return speed && *speed > 0 ? speed : std::nullopt;
}

constexpr int kJumboMtu = 9000;
constexpr unsigned kJumboBytes = 8000;
constexpr std::size_t kManyBytes = 500'000;  // for larger frames, small packets cost a whole core
constexpr int kLeastBuffer = 1 << 20;
constexpr double kRequestRatio = 1.0;  // each packet may be lost once on average; by default a quarter of them

Error in_words(const GErrorSlot& error, const char* what) {
  return Error{error.code(), std::string("the camera refuses the ") + what + ": " + error.message(), what};
}

std::int64_t receive_buffer_allowed() {
  std::int64_t bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> bytes;
  return bytes;
}

int receive_buffer_wanted(const AravisCameraOptions& options, std::size_t frame_bytes) {
  if (options.receive_buffer_bytes > 0) return options.receive_buffer_bytes;
  return static_cast<int>(std::clamp<std::size_t>(2 * frame_bytes, kLeastBuffer, 1u << 28));
}

/// Sets the buffer before the first packet. Aravis would do so only after it, and would lose that frame if the default
/// is too small.
void grow_receive_buffer(ArvGvStream* stream, int bytes) {
  const std::uint16_t port = arv_gv_stream_get_port(stream);
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", ignored)) {
    const int descriptor = std::atoi(entry.path().filename().c_str());
    sockaddr_in local{};
    socklen_t local_bytes = sizeof(local);
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&local), &local_bytes) != 0) continue;
    if (local.sin_family != AF_INET || ntohs(local.sin_port) != port) continue;
    int type = 0;
    socklen_t type_bytes = sizeof(type);
    ::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &type_bytes);
    if (type == SOCK_DGRAM) ::setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
  }
}

Result<> set_packet_size(ArvCamera* camera, const AravisCameraOptions& options) {
  GErrorSlot error;
  // The stream would otherwise try sizes again when it is created.
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  if (options.packet_bytes == 0) {
    arv_camera_gv_auto_packet_size(camera, error.out());
    return error.failed() ? tl::unexpected(in_words(error, "packet size")) : Result<>();
  }
  arv_camera_gv_set_packet_size(camera, options.packet_bytes, error.out());
  if (error.failed()) return tl::unexpected(in_words(error, "packet size"));
  const unsigned taken = arv_camera_gv_get_packet_size(camera, error.out());
  if (static_cast<int>(taken) == options.packet_bytes) return {};
  return fail(ErrorCode::kMismatch,
              "the camera uses packets of " + std::to_string(taken) + " bytes instead; set that, or 0", "packet_bytes");
}

}  // namespace

bool HostInterface::reaches(in_addr other) const {
  return ((address.s_addr ^ other.s_addr) & mask.s_addr) == 0;
}

std::string HostInterface::text() const {
  return name + " (" + address_text(address) + "/" + std::to_string(std::popcount(mask.s_addr)) + ")";
}

std::vector<HostInterface> list_host_interfaces() {
  std::vector<HostInterface> interfaces;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return interfaces;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    const bool usable = one->ifa_addr != nullptr && one->ifa_netmask != nullptr && (one->ifa_flags & IFF_UP) != 0;
    if (!usable || one->ifa_addr->sa_family != AF_INET) continue;
    interfaces.push_back({one->ifa_name, ipv4_of(one->ifa_addr), ipv4_of(one->ifa_netmask),
                          ::if_nametoindex(one->ifa_name), link_speed(one->ifa_name), mtu(one->ifa_name)});
  }
  ::freeifaddrs(first);
  return interfaces;
}

std::string address_text(in_addr address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

bool packet_socket_allowed() {
  return static_cast<bool>(FileDescriptor(::socket(PF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL))));
}

NetworkWarning device_clock_warning(std::string_view fault) {
  return {"device_clock",
          "the camera's clock " + std::string(fault) +
              ", so slsd times frames by their arrival: untriggered captures wait some frames longer, and a late frame "
              "ends the session; set device_clock = \"arrival\", and readout_us if you know it"};
}

NetworkWarning chunks_warning() {
  return {"chunks",
          "the camera's chunks do not match its description: slsd turned them off, and cannot notice frames of another "
          "exposure or gain; set chunks = false to skip the attempts"};
}

NetworkWarning first_frame_warning() {
  return {
      "first_frame",
      "the camera exposes only at a signal, so opening it cannot check that its frames arrive; the first scan does"};
}

NetworkWarning packet_size_warning(unsigned packet_bytes, const std::optional<HostInterface>& interface) {
  std::string advice = "packets have only " + std::to_string(packet_bytes) + " bytes";
  const int mtu_bytes = interface ? interface->mtu_bytes.value_or(0) : 0;
  if (mtu_bytes >= kJumboMtu)
    advice += ", although " + interface->name + " takes " + std::to_string(mtu_bytes) +
              ": allow 9000 on every switch and the camera, or set packet_bytes if the camera cannot test sizes";
  else
    advice += "; set the MTU of " + (interface ? interface->name : "the interface") + ", and of every switch, to 9000";
  return {"packet_size", advice};
}

NetworkWarning fragments_warning(int packet_bytes, const std::optional<HostInterface>& interface) {
  const char* const sizes = packet_bytes != 0 ? "set packet_bytes to 1500 or less, or to 0 to test sizes"
                                              : "it fragments test packets, too; set packet_bytes to 1500";
  return {"fragments", std::string("the network fragments the camera's packets, which tears frames: ") + sizes +
                           "; or set the MTU of " + (interface ? interface->name : "the interface") +
                           ", and of every switch, to 9000"};
}

NetworkWarning packet_socket_warning(const std::optional<HostInterface>& interface) {
  return {"packet_socket", "other devices keep sending on " + (interface ? interface->name : "the interface") +
                               ", so slsd reads the UDP socket, which loses more packets: give the camera its own "
                               "interface, or set packet_socket = false to skip the attempts"};
}

std::optional<HostInterface> interface_of(ArvCamera* camera) {
  if (!arv_camera_is_gv_device(camera)) return std::nullopt;
  auto* const device = ARV_GV_DEVICE(arv_camera_get_device(camera));
  auto* const address = G_INET_SOCKET_ADDRESS(arv_gv_device_get_interface_address(device));
  in_addr local{};
  std::memcpy(&local, g_inet_address_to_bytes(g_inet_socket_address_get_address(address)), sizeof(local));
  for (const HostInterface& interface : list_host_interfaces())
    if (interface.reaches(local)) return interface;
  return std::nullopt;
}

Result<> configure_packets(ArvCamera* camera, const AravisCameraOptions& options,
                           std::vector<NetworkWarning>& warnings) {
  if (!arv_camera_is_gv_device(camera)) return {};
  choose_socket(camera, options);
  if (auto done = set_packet_size(camera, options); !done) return done;
  GErrorSlot error;
  arv_camera_gv_set_packet_delay(camera, static_cast<gint64>(options.packet_delay_us * 1e3), error.out());
  if (error.failed() && options.packet_delay_us > 0.0) return tl::unexpected(in_words(error, "packet delay"));
  const unsigned size = arv_camera_gv_get_packet_size(camera, error.out());
  const unsigned payload = arv_camera_get_payload(camera, error.out());
  if (size < kJumboBytes && payload > kManyBytes) warnings.push_back(packet_size_warning(size, interface_of(camera)));
  return {};
}

void choose_socket(ArvCamera* camera, const AravisCameraOptions& options) {
  arv_camera_gv_set_stream_options(
      camera, options.packet_socket ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
}

bool takes_packet_socket(ArvStream* stream, const AravisCameraOptions& options) {
  return ARV_IS_GV_STREAM(stream) && options.packet_socket && packet_socket_allowed();
}

void configure_stream(ArvStream* stream, const AravisCameraOptions& options, std::size_t frame_bytes,
                      std::vector<NetworkWarning>& warnings) {
  if (!ARV_IS_GV_STREAM(stream)) return;
  const int wanted = receive_buffer_wanted(options, frame_bytes);
  // An incomplete frame is given up earlier than one that does not come at all, so that it is reported as torn.
  g_object_set(stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", wanted,
               "packet-request-ratio", kRequestRatio, "frame-retention",
               static_cast<guint>(options.frame_timeout_ms) * 500u, nullptr);
  grow_receive_buffer(ARV_GV_STREAM(stream), wanted);
  ArvGvStreamPacketResend resend = ARV_GV_STREAM_PACKET_RESEND_NEVER;
  g_object_get(stream, "packet-resend", &resend, nullptr);
  if (options.packet_resend && resend == ARV_GV_STREAM_PACKET_RESEND_NEVER)
    warnings.push_back({"packet_resend", "the camera cannot resend packets: each lost packet loses a frame"});
  if (!options.packet_resend) g_object_set(stream, "packet-resend", ARV_GV_STREAM_PACKET_RESEND_NEVER, nullptr);
  if (receive_buffer_allowed() >= wanted || takes_packet_socket(stream, options)) return;
  const std::string bytes = std::to_string(wanted);
  warnings.push_back({"receive_buffer", "net.core.rmem_max is " + std::to_string(receive_buffer_allowed()) +
                                            ", but frames need " + bytes + ": run sysctl -w net.core.rmem_max=" +
                                            bytes + " and keep it in /etc/sysctl.d, or give slsd CAP_NET_RAW"});
}

}  // namespace slsd
