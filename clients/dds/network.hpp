// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cdr.hpp"
#include "core/result.hpp"
#include "network_options.hpp"
#include "ros.hpp"

namespace slsd::dds {

enum class Quality {
  kSensor,   ///< clouds and images: the newest five; for readers of sensors' QoS, and for reliable ones
  kService,  ///< requests, replies and diagnostics: reliable, the newest ten
  kLatched,  ///< transforms: reliable, and for those who come later too
};

/// The writer of a sample, and what a reply to it is related by.
struct Requester {
  std::array<std::uint8_t, 16> guid{};  ///< GUID of the reader that waits for the reply, or of the writer
  std::uint64_t sequence_number = 0;
  bool is_cyclone = false;  ///< known by the vendor in the writer's GUID
};

struct Sample {
  Bytes bytes;
  Requester from;
};

/// Writes to one topic, and waits for no reader. @thread thread-safe
class Writer {
 public:
  /// Writes the message. @return false if what was written before will not leave within a second: clouds and images
  /// come too fast
  template <Message Value>
  bool write(const Value& message) const {
    return write_bytes(encode(message), nullptr);
  }
  /// Answers a request: waits until the one who asked can hear it, at most a second.
  template <Message Value>
  bool reply(const Value& message, const Requester& to) const {
    return write_bytes(encode(message), &to);
  }
  [[nodiscard]] bool has_readers() const;
  explicit operator bool() const { return state_ != nullptr; }

  struct State;
  explicit Writer(State* state = nullptr) : state_(state) {}

 private:
  bool write_bytes(const Bytes& bytes, const Requester* to) const;
  State* state_;  ///< belongs to the network, which outlives it
};

/// Reads one topic. @thread thread-bound
class Reader {
 public:
  /// The oldest sample that was not taken yet.
  [[nodiscard]] std::optional<Sample> take() const;
  [[nodiscard]] int writer_count() const;

  struct State;
  explicit Reader(State* state = nullptr) : state_(state) {}
  [[nodiscard]] bool has_news() const;

 private:
  State* state_;  ///< belongs to the network, which outlives it
};

/// A node of ROS 2: a participant of a DDS domain with ROS's names and qualities of service. What it writes never waits
/// for a reader: one that stalls loses what is older than the newest few.
/// @thread thread-safe
class Network {
 public:
  /// @errors kInvalidArgument: no such interface or peer
  [[nodiscard]] static Result<Network> open(const NetworkOptions& options);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) = delete;

  /// Shows the node /NAMESPACE/slsd, with all endpoints that there are and will be.
  void show_node(const std::string& name_space);

  /// @param topic  with its prefix, as DDS has it  @errors kIo
  [[nodiscard]] Result<Writer> writer(const ros::Type& type, const std::string& topic, Quality quality) const;
  [[nodiscard]] Result<Reader> reader(const ros::Type& type, const std::string& topic, Quality quality) const;

  /// The number of other writers of this topic so far.
  [[nodiscard]] int other_writers(const std::string& topic) const;
  /// Waits until one of these readers has a sample that was not taken, or the time is over.
  bool wait_for(const std::vector<Reader>& readers, std::chrono::milliseconds time) const;

  struct State;

 private:
  explicit Network(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Tells the others that this process leaves: all of its networks. Whoever writes or reads afterwards does nothing.
void leave_networks();

/// The advice if this host's sockets cannot hold a dense cloud; empty: none is needed. @thread reentrant
[[nodiscard]] std::string receive_buffer_warning();

}  // namespace slsd::dds
