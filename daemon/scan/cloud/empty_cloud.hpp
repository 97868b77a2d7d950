// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/calibrate/doubt/calibration_doubts.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "daemon/scan/rig/frame_set.hpp"

namespace slsd {

/// The pattern, calibration and working range of a scan, which explain an empty cloud. Borrows all three.
struct ScanBasis {
  const Pattern& pattern;
  const std::optional<Calibration>& calibration;
  DepthRange range;
  const std::vector<std::string>& doubts;  ///< doubts about the calibration, from calibration_doubts()
};

/// Says why scans gave no points.
/// @thread thread-safe: lanes share it. A separate thread reads the frames, so that no scan is delayed
class EmptyClouds {
 public:
  /// @param cameras  the calibration's cameras, one for each frame
  /// @param until    the end of its wait for what the frames tell about the calibration; a later result serves the next
  ///                 empty cloud
  [[nodiscard]] std::string explain(const ScanBasis& basis, const FrameSet& set,
                                    const std::vector<std::size_t>& cameras, const ScanResult& result,
                                    MonotonicTime until);

 private:
  struct Doubt {
    std::string text;
    MonotonicTime next;  ///< no new look before this time
  };
  [[nodiscard]] std::string doubt(const ScanBasis& basis, const FrameSet& set, const std::vector<std::size_t>& cameras,
                                  MonotonicTime until);

  std::mutex mutex_;
  std::shared_future<Doubt> doubt_;  ///< result of the last look
};

}  // namespace slsd
