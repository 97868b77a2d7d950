// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige/fragment_watch.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <netinet/ip.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>

namespace slsd {
namespace {

constexpr std::uint32_t kFragment = IP_MF | IP_OFFMASK;
constexpr std::uint32_t kFlagsAt = 6, kSourceAt = 12;  // byte offsets in the IP header

/// The filter for fragments of IP packets from this source. It keeps one byte of each.
std::array<sock_filter, 6> pieces_of(in_addr source) {
  return {{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kSourceAt),
           BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(source.s_addr), 0, 3),
           BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFlagsAt), BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, kFragment, 0, 1),
           BPF_STMT(BPF_RET | BPF_K, 1), BPF_STMT(BPF_RET | BPF_K, 0)}};
}

}  // namespace

// The socket hears nothing before it has a protocol, and its filter is set before that. It keeps almost no unread data;
// the kernel counts dropped fragments too.
FragmentWatch::FragmentWatch(in_addr camera) : socket_(::socket(PF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  auto filter = pieces_of(camera);
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  const int least = 0;
  sockaddr_ll everywhere{};
  everywhere.sll_family = AF_PACKET;
  everywhere.sll_protocol = htons(ETH_P_IP);
  const bool watches =
      socket_ && ::setsockopt(socket_.number(), SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) == 0 &&
      ::setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUF, &least, sizeof(least)) == 0 &&
      ::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&everywhere), sizeof(everywhere)) == 0;
  if (!watches) socket_ = FileDescriptor();
}

bool FragmentWatch::seen() {
  tpacket_stats counted{};
  socklen_t bytes = sizeof(counted);
  if (!seen_ && socket_ && ::getsockopt(socket_.number(), SOL_PACKET, PACKET_STATISTICS, &counted, &bytes) == 0)
    seen_ = counted.tp_packets > 0;
  return seen_;
}

}  // namespace slsd
