// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <dds/dds.h>

#include "core/result.hpp"

namespace slsd::dds {

/// How to reach the others.
struct NetworkOptions {
  std::uint32_t domain = 0;        ///< ROS_DOMAIN_ID
  std::string interface;           ///< "eth0", "lo"; empty: the one that Cyclone DDS chooses
  std::vector<std::string> peers;  ///< addresses of the others, without multicast; empty: found by multicast
  bool best_effort = false;        ///< clouds and images that are lost on the way are not sent again
};

/// A participant of a DDS domain with ROS 2's names and qualities of service. What it writes never waits for a reader:
/// one that stalls loses what is older than the newest few.
/// @thread thread-safe
class Network {
 public:
  /// @errors kInvalidArgument: no such interface or peer, or wrong CYCLONEDDS_URI
  [[nodiscard]] static Result<Network> open(const NetworkOptions& options);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) = delete;

  enum class Quality {
    kSensor,   ///< clouds and images: the newest five; for readers of sensors' QoS, and for reliable ones
    kService,  ///< requests, replies and diagnostics: reliable, the newest ten
    kLatched,  ///< transforms: reliable, and for those who come later too
  };
  /// @param topic  without "rt/"  @errors kIo
  [[nodiscard]] Result<dds_entity_t> writer(const dds_topic_descriptor_t& type, const std::string& topic,
                                            Quality quality) const;
  [[nodiscard]] Result<dds_entity_t> reader(const dds_topic_descriptor_t& type, const std::string& topic,
                                            Quality quality) const;

  /// How many others write this topic by now.
  /// @param topic  with its prefix, as DDS has it
  [[nodiscard]] int other_writers(const std::string& topic) const;

 private:
  Network(dds_entity_t domain, dds_entity_t participant, bool best_effort)
      : domain_(domain), participant_(participant), best_effort_(best_effort) {}
  [[nodiscard]] Result<dds_entity_t> topic(const dds_topic_descriptor_t& type, const std::string& name) const;

  dds_entity_t domain_, participant_;
  dds_entity_t publications_ = 0;  ///< reader of what others write
  bool best_effort_;
};

/// What to do where this host's sockets cannot hold a dense cloud; empty: nothing. @thread reentrant
[[nodiscard]] std::string receive_buffer_warning();

/// Waits until one of these readers has a sample that was not read, or the time is over.
bool wait_for(const std::vector<dds_entity_t>& readers, std::chrono::milliseconds time);

}  // namespace slsd::dds
