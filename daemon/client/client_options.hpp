// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>

namespace slsd {

inline constexpr int kDone = 0;
inline constexpr int kRequestFailed = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNoDaemon = 3;

/// slsctl's command line.
struct ClientOptions {
  std::filesystem::path socket = "/run/slsd/slsd.sock";
  bool json = false;
  std::filesystem::path output;         ///< scan: the cloud, .ply or .pcd; empty: not kept
  std::filesystem::path picture;        ///< scan: the frame with what was decoded
  std::filesystem::path cloud_picture;  ///< scan: the cloud, drawn
  std::filesystem::path image;          ///< preview, frame, pattern: the PNG to write
  std::optional<int> timeout_ms;
  std::optional<double> rate_hz;  ///< watch
  std::uint64_t count = 0;        ///< watch: clouds after which it ends; 0: none
};

}  // namespace slsd
