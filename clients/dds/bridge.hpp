// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "messages.hpp"
#include "network.hpp"

namespace slsd::dds {

struct BridgeOptions {
  std::string name = "scanner";      ///< the scanner's name in the network: its topics begin with it
  std::string socket;                ///< the service's socket; empty: the usual place
  std::optional<double> rate_hz;     ///< clouds; 0: only those that are triggered; nothing: every frame
  std::string density;               ///< "symbols" or "pixels"; empty: as configured
  Thinning thinning;                 ///< thins clouds and depth images
  double image_rate_hz = 0;          ///< images of every camera; 0: none
  bool transforms = true;            ///< false: a robot's own description has the scanner's frames
  std::filesystem::path extrinsics;  ///< file with the scanner's place; empty: nobody tells it
};

/// The robot description (URDF) of a scanner: by the calibration in that file, or that of the service if it is empty.
/// @errors kInvalidArgument: no name of ROS; kNotFound: no file, or not calibrated; kIo: no service; kMalformed
[[nodiscard]] Result<std::string> describe(const BridgeOptions& options, const std::filesystem::path& file);

/// One scanner in a ROS 2 network. Ends with the process.
/// Threads: one waits for clouds, one for triggers, one asks for the state each second and for images.
class Bridge {
 public:
  /// @errors kInvalidArgument: no name of ROS; kAlreadyExists: another scanner of this name is there;
  ///         kNotFound, kMalformed: extrinsics
  [[nodiscard]] static Result<std::unique_ptr<Bridge>> start(const BridgeOptions& options, Network network);
  virtual ~Bridge() = default;
};

}  // namespace slsd::dds
