// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "network.hpp"

namespace slsd::dds {

/// The endpoints that a scanner and a merged cloud share in a ROS 2 network, beside their clouds.

/// Said once when clouds come faster than they may leave.
inline constexpr const char* kOvertaken =
    "clouds come faster than they may leave, and some are not published: lower --rate, thin them by --stride or "
    "--voxel, or raise --rate-max";

/// Tells whether ROS takes it for a topic's name: letters, digits and _, a letter first.
[[nodiscard]] bool is_ros_name(const std::string& name);

/// std_msgs/Empty on NAME/trigger, and the service NAME/trigger (std_srvs/Trigger) for clients of any middleware: Fast
/// DDS and others relate a reply to its request beside the data, rmw_cyclonedds in front of it.
/// @thread thread-bound
class Trigger {
 public:
  /// Scans; whether it went well, and what is to be said of it.
  using Scan = std::function<std::pair<bool, std::string>()>;

  /// @param network  outlives it
  [[nodiscard]] static Result<Trigger> open(const Network& network, const std::string& name);
  /// Waits for a second, and scans for those who asked.
  void answer(const Scan& scan) const;

 private:
  const Network* network_ = nullptr;
  Reader topic_, requests_;
  Writer replies_;
};

/// The levels of ROS diagnostics.
enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2 };

/// A state, and the worst that is to be said of it, for /diagnostics.
struct Diagnosis {
  Level level = Level::kOk;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values;

  void worse(Level how, const std::string& why) {
    if (how > level) level = how, message = why;
  }
};

/// @param hardware  what is diagnosed, by its name in the network  @param of  "left: slsd"
void write_diagnosis(const Writer& writer, const Diagnosis& diagnosis, const std::string& hardware,
                     const std::string& of);

}  // namespace slsd::dds
