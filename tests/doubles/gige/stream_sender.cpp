// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/stream_sender.hpp"

#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <thread>

#include "tests/doubles/gige/wire.hpp"

namespace slsd::test {
namespace {

constexpr std::uint32_t kHeaderBytes = 20 + 8 + 8;  // IP, UDP, GVSP
constexpr std::uint32_t kUdpBytes = 20 + 8;
constexpr std::uint32_t kLeader = 1;
constexpr std::uint32_t kTrailer = 2;
constexpr std::uint32_t kPayload = 3;
constexpr std::uint32_t kPacketsAtOnce = 32;

std::size_t payload_bytes(const StreamTarget& target) {
  return target.packet_bytes - kHeaderBytes;
}

/// Leader, payload and trailer.
std::uint32_t packet_count(const WireFrame& frame, const StreamTarget& target) {
  const auto bytes = static_cast<std::size_t>(std::ceil(static_cast<double>(frame.pixels.size()) * frame.sent_share));
  return static_cast<std::uint32_t>((bytes + payload_bytes(target) - 1) / payload_bytes(target)) + 2;
}

void write_leader(WireWriter& writer, const WireFrame& frame) {
  writer.u16(0).u16(frame.payload_type);
  writer.u32(static_cast<std::uint32_t>(frame.ticks >> 32)).u32(static_cast<std::uint32_t>(frame.ticks));
  writer.u32(frame.pixel_format).u32(frame.width_px).u32(frame.height_px).u32(0).u32(0).u32(0);
}

}  // namespace

StreamSender::StreamSender(in_addr address) : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_addr = address;
  if (socket_ < 0 || ::bind(socket_, reinterpret_cast<const sockaddr*>(&local), sizeof(local)) != 0)
    throw std::runtime_error("the double has no socket for its stream");
  // As cameras have it: packets that are too large for the network are lost, and not sent in fragments. So the sizes
  // that a host tries tell what the network takes.
  const int never = IP_PMTUDISC_DO;
  ::setsockopt(socket_, IPPROTO_IP, IP_MTU_DISCOVER, &never, sizeof(never));
}

void StreamSender::break_up() {
  const int always = IP_PMTUDISC_DONT;
  ::setsockopt(socket_, IPPROTO_IP, IP_MTU_DISCOVER, &always, sizeof(always));
}

StreamSender::~StreamSender() {
  ::close(socket_);
}

void StreamSender::lose(double share, std::uint32_t seed) {
  loss_ = share;
  random_.seed(seed);
}

WireFrame& StreamSender::next_frame() {
  current_ = (current_ + 1) % frames_.size();
  current().sent_share = 1.0;
  return current();
}

void StreamSender::begin(const StreamTarget& target) {
  target_ = target;
  packets_ = packet_count(current(), target);
  next_packet_ = 0;
}

void StreamSender::send_some() {
  const std::uint32_t end = std::min(next_packet_ + kPacketsAtOnce, packets_);
  for (; next_packet_ < end; ++next_packet_) send_block(current(), next_packet_, target_);
  if (target_.packet_delay.count() > 0) std::this_thread::sleep_for(target_.packet_delay * kPacketsAtOnce);
}

void StreamSender::forget() {
  stop();
  for (WireFrame& frame : frames_) frame.id = 0;
}

void StreamSender::send_again(std::uint16_t id, std::uint32_t first, std::uint32_t last, const StreamTarget& target) {
  const auto found = std::ranges::find(frames_, id, &WireFrame::id);
  if (found == frames_.end() || found->pixels.empty()) return;
  const std::uint32_t packets = packet_count(*found, target);
  for (std::uint32_t packet = first; packet <= last && packet < packets; ++packet) {
    send_block(*found, packet, target);
    ++packets_sent_again_;
  }
}

void StreamSender::send_test_packet(const StreamTarget& target) {
  header_.assign(target.packet_bytes - kUdpBytes, 0);
  send(header_, nullptr, 0, target);
}

void StreamSender::send_block(const WireFrame& frame, std::uint32_t packet, const StreamTarget& target) {
  if (loss_ > 0.0 && static_cast<double>(random_()) < loss_ * 4294967296.0) {
    ++packets_lost_;
    return;
  }
  const std::uint32_t last = packet_count(frame, target) - 1;
  WireWriter writer(header_);
  writer.u16(0).u16(frame.id);
  if (packet == 0) {
    writer.u8(kLeader).u24(packet);
    write_leader(writer, frame);
    return send(header_, nullptr, 0, target);
  }
  if (packet == last) {
    writer.u8(kTrailer).u24(packet).u16(0).u16(frame.payload_type).u32(frame.height_px);
    return send(header_, nullptr, 0, target);
  }
  writer.u8(kPayload).u24(packet);
  const std::size_t begin = (packet - 1) * payload_bytes(target);
  const std::size_t bytes = std::min(payload_bytes(target), frame.pixels.size() - begin);
  send(header_, frame.pixels.data() + begin, bytes, target);
}

void StreamSender::send(const std::vector<std::uint8_t>& header, const std::uint8_t* payload, std::size_t payload_size,
                        const StreamTarget& target) {
  std::array<iovec, 2> parts{iovec{const_cast<std::uint8_t*>(header.data()), header.size()},
                             iovec{const_cast<std::uint8_t*>(payload), payload_size}};
  sockaddr_in to = target.address;
  msghdr message{};
  message.msg_name = &to;
  message.msg_namelen = sizeof(to);
  message.msg_iov = parts.data();
  message.msg_iovlen = payload_size > 0 ? 2 : 1;
  // A packet that the network does not take is a packet lost.
  if (::sendmsg(socket_, &message, MSG_NOSIGNAL) < 0) ++packets_lost_;
}

}  // namespace slsd::test
