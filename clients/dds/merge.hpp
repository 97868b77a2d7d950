// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "network/network.hpp"

namespace slsd::dds {

struct MergeOptions {
  std::string name = "merged";        ///< the merged cloud's name; its topics begin with it
  std::filesystem::path extrinsics;   ///< file with the scanners' positions
  std::vector<std::string> scanners;  ///< empty: all in the file
  /// A cloud older than the newest by more than this is left out. A scanner silent for this long is not waited for.
  std::chrono::duration<double> max_age{1.0};
};

/// Merges the clouds of several scanners into one, in the frame of their extrinsics. Publishes when every active
/// scanner has sent a new cloud. Leaves out clouds without a certain position (missing or stale extrinsics, two
/// scanners of one name, a message not from slsd); /diagnostics gives the reason. Runs until the process ends. Has
/// three threads: one reads clouds and diagnostics and merges, one answers triggers, one reports the state each second.
class Merge {
 public:
  /// @errors kInvalidArgument: not a valid ROS name; kAlreadyExists: another node has this name; kNotFound: a scanner
  ///         is not in the file; kMalformed: the file
  [[nodiscard]] static Result<std::unique_ptr<Merge>> start(const MergeOptions& options, Network network);
  virtual ~Merge() = default;
};

}  // namespace slsd::dds
