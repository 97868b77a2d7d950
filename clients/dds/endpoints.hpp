// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "network/network.hpp"

namespace slsd::dds {

/// The endpoints that scanners and merged clouds have in common in a ROS 2 network, besides their clouds.

/// Reported once when clouds come faster than they can be sent.
inline constexpr const char* kOvertaken =
    "clouds exceed the rate limit, and some are not published: lower --rate, thin clouds with --stride or --voxel, or "
    "raise --rate-max";

/// Tells whether ROS accepts the topic name: letters, digits and _, a letter first.
[[nodiscard]] bool is_ros_name(const std::string& name);

/// std_msgs/Empty on NAME/trigger, and the service NAME/trigger (std_srvs/Trigger) for clients of any middleware. Fast
/// DDS and others relate a reply to its request beside the data; rmw_cyclonedds does so in front of the data.
/// @thread thread-bound
class Trigger {
 public:
  /// Scans; returns whether it succeeded, and a message.
  using Scan = std::function<std::pair<bool, std::string>()>;

  /// @param network  must outlive it
  [[nodiscard]] static Result<Trigger> open(const Network& network, const std::string& name);
  /// Waits for a second, and scans if somebody requested it.
  void answer(const Scan& scan) const;

 private:
  const Network* network_ = nullptr;
  Reader topic_, requests_;
  Writer replies_;
};

/// The levels of ROS diagnostics.
enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2 };

/// A state and its worst problem, for /diagnostics.
struct Diagnosis {
  Level level = Level::kOk;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values;

  void worse(Level how, const std::string& why) {
    if (how > level) level = how, message = why;
  }
};

/// @param hardware  the diagnosed device, by its name in the network  @param of  "left: slsd"
void write_diagnosis(const Writer& writer, const Diagnosis& diagnosis, const std::string& hardware,
                     const std::string& of);

}  // namespace slsd::dds
