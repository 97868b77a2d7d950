// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/decode/decoding.hpp"
#include "daemon/scan/stage_clock.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

using RegionCounts = std::array<std::uint32_t, kRegionStatusCount>;

struct ScanRequest {
  MonotonicTime deadline;  ///< for the devices to be ready and the frames to be there
  bool picture = false;    ///< also draw what was decoded in the frame
  std::string camera;      ///< whose picture; empty: the first's
};

/// What a scan gave.
struct ScanResult {
  Cloud cloud;
  RegionCounts regions{};  ///< of all cameras, by status
  std::chrono::nanoseconds capture_time{};
  std::chrono::nanoseconds decode_time{};
  StageTimes stage_times{};
  std::string picture_png;  ///< empty unless asked for
};

/// One camera's image as it came.
struct FrameImage {
  std::string bytes;  ///< a PNG, or pixels row by row, 16 bits little-endian
  int width_px = 0;
  int height_px = 0;
  int bits = 8;
  std::uint64_t sequence = 0;
};

}  // namespace slsd
