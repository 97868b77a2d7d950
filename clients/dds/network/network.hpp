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
#include "network/network_options.hpp"
#include "ros.hpp"

namespace slsd::dds {

enum class Quality {
  kSensor,      ///< clouds and images: the newest five; for readers with sensor or reliable QoS
  kService,     ///< requests, replies and diagnostics: reliable, the newest ten
  kLatched,     ///< fixed transforms and descriptions: reliable, also for later readers; these keep a hundred
  kTransforms,  ///< moving transforms: reliable, the newest hundred
};

/// The writer of a sample, and the data that relates a reply to it.
struct Requester {
  std::array<std::uint8_t, 16> guid{};  ///< GUID of the reader that waits for the reply, or of the writer
  std::uint64_t sequence_number = 0;
  bool is_cyclone = false;  ///< recognised by the vendor in the writer's GUID
};

struct Sample {
  Bytes bytes;
  Requester from;
};

/// Writes to one topic without waiting for readers. @thread thread-safe
class Writer {
 public:
  /// Writes the message. @return false if earlier data cannot be sent within a second: clouds and images come too fast
  template <Message Value>
  bool write(const Value& message) const {
    return write_bytes(encode(message), nullptr);
  }
  /// Answers a request. Waits at most a second until the requester can receive the reply.
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
  State* state_;  ///< belongs to the network, which must outlive it
};

/// Reads one topic. @thread thread-bound
class Reader {
 public:
  /// The oldest sample not taken yet.
  [[nodiscard]] std::optional<Sample> take() const;
  [[nodiscard]] int writer_count() const;

  struct State;
  explicit Reader(State* state = nullptr) : state_(state) {}
  [[nodiscard]] bool has_news() const;

 private:
  State* state_;  ///< belongs to the network, which must outlive it
};

/// A ROS 2 node: a participant of a DDS domain with ROS's names and qualities of service. Writing never waits for a
/// reader: one that stalls loses all but the newest few samples.
/// @thread thread-safe
class Network {
 public:
  /// @errors kInvalidArgument: no such interface or peer
  [[nodiscard]] static Result<Network> open(const NetworkOptions& options);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) = delete;

  /// Announces the node /NAMESPACE/slsd, with all current and future endpoints.
  void show_node(const std::string& name_space);

  /// @param topic  with its DDS prefix  @errors kIo
  [[nodiscard]] Result<Writer> writer(const ros::Type& type, const std::string& topic, Quality quality) const;
  [[nodiscard]] Result<Reader> reader(const ros::Type& type, const std::string& topic, Quality quality) const;

  /// The number of other writers discovered for this topic so far.
  [[nodiscard]] int other_writers(const std::string& topic) const;
  /// Waits until one of these readers has an untaken sample, or the time is over.
  bool wait_for(const std::vector<Reader>& readers, std::chrono::milliseconds time) const;

  struct State;

 private:
  explicit Network(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Announces that this process leaves all its networks. Later reads and writes do nothing.
void leave_networks();

/// Tells whether a write hangs in Fast DDS, which then publishes nothing more. Call it once a second.
[[nodiscard]] bool write_hangs();

/// The advice if this host's socket buffers cannot hold a dense cloud; else empty. @thread reentrant
[[nodiscard]] std::string receive_buffer_warning();

}  // namespace slsd::dds
