// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "daemon/scan/backoff.hpp"
#include "daemon/scan/camera_runner.hpp"
#include "daemon/scan/device_status.hpp"
#include "daemon/scan/scan_result.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// The projector and the cameras, and a scan with them as a transaction: the pattern is shown and visible, every camera
/// exposes one frame after that, all at the same time, and the frames are decoded: one cloud, or one error.
///
///     trigger        exposure_start (each camera)          received        deadline
///     --|-----------------|-----------------------------------|---------------|-->
///     pattern visible     within exposure_skew_ms of one another
///
/// @thread thread-bound, but for request_stop() and the statuses
class Rig {
 public:
  Rig(std::unique_ptr<Projector> projector, std::vector<std::unique_ptr<Camera>> cameras, ScanSetup setup,
      const ScanOptions& options);

  /// Opens the projector and shows the pattern, if that is due.
  void supervise();

  /// @errors kNotFound: no camera or no calibration; kTimeout: a device is not ready; kFrameDropped, kFrameTorn,
  ///         kFrameStale, kFrameLate, kDisconnected; kMismatch: exposures apart, or frames of another size; kCancelled
  [[nodiscard]] Result<ScanResult> scan(const ScanRequest& request, const std::string& scan_id);

  /// One frame of one camera while the pattern is visible.
  /// @param camera  its name; empty: the first
  /// @param as_png  else the pixels as they are
  [[nodiscard]] Result<FrameImage> frame(const std::string& camera, bool as_png, MonotonicTime deadline);

  /// Takes another pattern, calibration and decoder from the next scan on.
  void replace(ScanSetup setup);
  [[nodiscard]] const ScanSetup& setup() const { return setup_; }

  void request_stop();
  [[nodiscard]] DeviceStatus projector_status() const;
  [[nodiscard]] std::vector<DeviceStatus> camera_statuses() const;

 private:
  [[nodiscard]] Result<> open_projector();
  void note_projector(const Result<>& opened);
  [[nodiscard]] Result<> show_pattern(MonotonicTime deadline);
  [[nodiscard]] Result<std::size_t> find_camera(const std::string& name) const;
  [[nodiscard]] Result<std::vector<Frame>> capture(const std::vector<std::size_t>& cameras, MonotonicTime deadline);
  [[nodiscard]] Result<> check_frames(const std::vector<std::size_t>& cameras, const std::vector<Frame>& frames,
                                      MonotonicTime trigger, MonotonicTime deadline) const;
  [[nodiscard]] Result<> decode(const std::vector<Frame>& frames, const ScanRequest& request, ScanResult& result);

  std::unique_ptr<Projector> projector_;
  std::vector<std::unique_ptr<CameraRunner>> cameras_;
  ScanSetup setup_;
  ScanOptions options_;
  Backoff backoff_;
  MonotonicTime next_attempt_{};
  MonotonicTime visible_{};
  bool shown_ = false;
  std::stop_source stopping_;
  mutable std::mutex mutex_;  ///< guards projector_status_
  DeviceStatus projector_status_;
};

}  // namespace slsd
