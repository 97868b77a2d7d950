// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "messages.hpp"
#include "network/network.hpp"

namespace slsd::dds {

struct BridgeOptions {
  std::string name = "scanner";          ///< the scanner's name in the network; its topics begin with it
  std::string socket;                    ///< the service's socket; empty: the usual place
  std::optional<double> rate_hz;         ///< of clouds; 0: only triggered ones; nothing: every frame
  std::string density;                   ///< "symbols" or "pixels"; empty: as configured
  bool colour = false;                   ///< triggered scans have the surface's colours
  Thinning thinning;                     ///< reduces clouds and depth images
  double image_rate_hz = 0;              ///< of images from every camera; 0: none
  bool transforms = true;                ///< false: the robot's own description contains the scanner's frames
  std::string robot_base = "base_link";  ///< frame of clouds in the robot's base
  std::string flange;  ///< the frame in tf that carries the scanner, which places clouds in robot_base; empty: none
  std::filesystem::path extrinsics;  ///< file with the scanner's position; empty: unknown
};

/// The robot description (URDF) of a scanner, from that calibration file; if empty, from the service's calibration.
/// @errors kInvalidArgument: not a valid ROS name; kNotFound: no file, or not calibrated; kIo: no service; kMalformed
[[nodiscard]] Result<std::string> describe(const BridgeOptions& options, const std::filesystem::path& file);

/// One scanner in a ROS 2 network, until the process ends. Has three threads: one receives clouds, one waits for
/// triggers, and one reads the state each second, and images. With a flange, RobotPoses has one more.
class Bridge {
 public:
  /// @errors kInvalidArgument: not a valid ROS name; kAlreadyExists: another scanner has this name; kNotFound,
  ///         kMalformed: extrinsics
  [[nodiscard]] static Result<std::unique_ptr<Bridge>> start(const BridgeOptions& options, Network network);
  virtual ~Bridge() = default;
};

}  // namespace slsd::dds
