// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "daemon/scan/decode_lanes.hpp"
#include "daemon/scan/frame_set.hpp"
#include "daemon/scan/scan_result.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

// The decoders of the scans under way; shared, as a reload may replace them meanwhile.
using SharedSetup = std::shared_ptr<ScanSetup>;

/// From a set of frames, or the reason why there is none, to the outcome of its scan.
class ScanJob final : public FrameJob {
 public:
  using Told = std::function<void(Result<ScanResult>)>;
  ScanJob(Result<FrameSet> set, SharedSetup setup, ScanRequest request, std::string scan_id, Told told);

  void compute(std::size_t lane) override;
  void deliver() override { told_(std::move(result_)); }

 private:
  Result<FrameSet> set_;
  SharedSetup setup_;
  ScanRequest request_;
  std::string scan_id_;
  Told told_;
  Result<ScanResult> result_;
};

/// From a frame to its image.
class ImageJob final : public FrameJob {
 public:
  using Told = std::function<void(Result<FrameImage>)>;
  ImageJob(Frame frame, bool as_png, Told told);

  void compute(std::size_t lane) override;
  void deliver() override { told_(std::move(result_)); }

 private:
  std::optional<Frame> frame_;
  bool as_png_;
  Told told_;
  Result<FrameImage> result_;
};

}  // namespace slsd
