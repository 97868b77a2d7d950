// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "network.hpp"

namespace slsd::dds {

/// What a scanner and a merged cloud have in common in a ROS 2 network, beside their clouds.

/// Whether ROS takes it for a topic's name: letters, digits and _, a letter first.
[[nodiscard]] bool is_ros_name(const std::string& name);

/// std_msgs/Empty on NAME/trigger, and the service NAME/trigger (std_srvs/Trigger).
/// @thread thread-bound
class Trigger {
 public:
  /// Scans; whether it went well, and what is to be said of it.
  using Scan = std::function<std::pair<bool, std::string>()>;

  [[nodiscard]] static Result<Trigger> open(const Network& network, const std::string& name);
  /// Waits for a second, and scans for those who asked.
  void answer(const Scan& scan) const;

 private:
  dds_entity_t topic_ = 0, requests_ = 0, replies_ = 0;
};

/// As ROS has them.
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
void write_diagnosis(dds_entity_t writer, Diagnosis diagnosis, std::string hardware, std::string of);

}  // namespace slsd::dds
