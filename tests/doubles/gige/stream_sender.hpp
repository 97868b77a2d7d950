// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>
#include <array>
#include <chrono>
#include <cstdint>
#include <random>
#include <vector>

namespace slsd::test {

/// One frame as GVSP carries it.
struct WireFrame {
  std::uint16_t id = 0;
  std::uint64_t ticks = 0;         ///< the device's clock when the exposure began
  std::uint32_t payload_type = 1;  ///< an image
  std::uint32_t pixel_format = 0;
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  double sent_share = 1.0;           ///< below 1: so much of it is sent, and then the trailer, as if it were whole
  std::vector<std::uint8_t> pixels;  ///< and what is behind them
};

/// Where a stream goes.
struct StreamTarget {
  sockaddr_in address{};
  std::uint32_t packet_bytes = 1400;  ///< with the headers of IP, UDP and GVSP, as GVCP counts
  std::chrono::nanoseconds packet_delay{0};
};

/// Sends frames as GVSP packets and keeps the last ones, to send packets again. Loses packets on demand.
/// @thread thread-bound
class StreamSender {
 public:
  /// @param address  a local IPv4 address, in network order
  explicit StreamSender(in_addr address);
  ~StreamSender();
  StreamSender(const StreamSender&) = delete;
  StreamSender& operator=(const StreamSender&) = delete;

  /// The share of packets that are not sent, sent-again ones too; seeded.
  void lose(double share, std::uint32_t seed);
  /// Packets that are too large for the network are sent in fragments, as few cameras have it.
  void break_up();

  /// A frame to fill for begin(); it is the oldest of those kept.
  [[nodiscard]] WireFrame& next_frame();
  void begin(const StreamTarget& target);
  [[nodiscard]] bool sending() const { return next_packet_ < packets_; }
  /// Sends some packets of the frame that begin() began.
  void send_some();
  void stop() { packets_ = next_packet_ = 0; }
  /// Forgets the frames that were sent, whose numbers come again.
  void forget();

  /// Sends packets again, if their frame is still kept.
  void send_again(std::uint16_t id, std::uint32_t first, std::uint32_t last, const StreamTarget& target);
  /// An empty packet, to try a size.
  void send_test_packet(const StreamTarget& target);

  [[nodiscard]] std::uint64_t packets_lost() const { return packets_lost_; }
  [[nodiscard]] std::uint64_t packets_sent_again() const { return packets_sent_again_; }

 private:
  [[nodiscard]] WireFrame& current() { return frames_[current_]; }
  void send_block(const WireFrame& frame, std::uint32_t packet, const StreamTarget& target);
  void send(const std::vector<std::uint8_t>& header, const std::uint8_t* payload, std::size_t payload_bytes,
            const StreamTarget& target);

  int socket_;
  std::array<WireFrame, 16> frames_;
  std::size_t current_ = 0;
  StreamTarget target_;
  std::uint32_t packets_ = 0;
  std::uint32_t next_packet_ = 0;
  std::mt19937 random_{1};
  double loss_ = 0.0;
  std::vector<std::uint8_t> header_;
  std::uint64_t packets_lost_ = 0;
  std::uint64_t packets_sent_again_ = 0;
};

}  // namespace slsd::test
