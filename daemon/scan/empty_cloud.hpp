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
#include "daemon/scan/frame_set.hpp"
#include "daemon/scan/scan_result.hpp"

namespace slsd {

/// Reads the pattern without a calibration, and compares the symbols with it. Takes a second or so.
/// @param camera  an index in the calibration
/// @param read    out: how many symbols were read
/// @return a sentence about the calibration; empty if it explains the symbols, or too few were read
/// @thread reentrant
[[nodiscard]] std::string doubt_by_frame(const GreyView& frame, const Pattern& pattern, const Calibration& calibration,
                                         std::size_t camera, const DepthRange& range, std::size_t& read);

/// Pattern, calibration and working range of a scan, by which an empty cloud is explained. Borrows.
struct ScanBasis {
  const Pattern& pattern;
  const std::optional<Calibration>& calibration;
  DepthRange range;
  const std::vector<std::string>& doubts;  ///< about the calibration, as calibration_doubts() has them
};

/// Says why scans gave no points.
/// @thread thread-safe: lanes share it. Frames are read in a thread of its own, so that no scan is late for it
class EmptyClouds {
 public:
  /// @param cameras  of the calibration, one to a frame
  /// @param until    how long it may wait for what the frames say of the calibration; the next empty cloud has it
  [[nodiscard]] std::string explain(const ScanBasis& basis, const FrameSet& set,
                                    const std::vector<std::size_t>& cameras, const ScanResult& result,
                                    MonotonicTime until);

 private:
  struct Doubt {
    std::string text;
    MonotonicTime next;  ///< it is not worth to look again before
  };
  [[nodiscard]] std::string doubt(const ScanBasis& basis, const FrameSet& set, const std::vector<std::size_t>& cameras,
                                  MonotonicTime until);

  std::mutex mutex_;
  std::shared_future<Doubt> doubt_;  ///< result of the last look
};

}  // namespace slsd
