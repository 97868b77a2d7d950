// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "network.hpp"

namespace slsd::dds {

struct MergeOptions {
  std::string name = "merged";        ///< the merged cloud's name: its topics begin with it
  std::filesystem::path extrinsics;   ///< file with the scanners' places
  std::vector<std::string> scanners;  ///< empty: all that the file names
  /// A cloud that is so much older than the newest is left out, and a scanner that sends none for so long is not waited
  /// for.
  std::chrono::duration<double> max_age{1.0};
};

/// Clouds of several scanners as one, in the frame of their extrinsics: published when each that sends clouds has sent
/// a new one. A cloud that cannot be placed for certain (extrinsics missing or stale, two scanners of its name, a
/// message that is none of slsd's) is left out, and /diagnostics says why. Ends with the process. Threads: one reads
/// clouds and diagnostics and merges, one answers triggers, one tells the state each second.
class Merge {
 public:
  /// @errors kInvalidArgument: no name of ROS; kAlreadyExists: another of this name is there; kNotFound: the file does
  ///         not name a scanner; kMalformed: the file
  [[nodiscard]] static Result<std::unique_ptr<Merge>> start(const MergeOptions& options, Network network);
  virtual ~Merge() = default;
};

}  // namespace slsd::dds
