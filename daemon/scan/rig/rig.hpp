// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/scan/rig/camera_runner.hpp"
#include "daemon/scan/rig/device_status.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/rig/projection.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// The projector and the cameras. A capture is a transaction: once the pattern is visible, every camera exposes one
/// frame, all at the same time. It gives one set of frames, or one error. If a scan wants them, exposures under white
/// and under black follow.
///
///     trigger        exposure_start (each camera)          received        deadline
///     --|-----------------|-----------------------------------|---------------|-->
///     pattern visible     within exposure_skew_ms of one another
///
/// @thread thread-bound, except request_stop(), stopped(), kept() and the statuses
class Rig {
 public:
  /// @param image         the pattern that the projector shows during scans
  /// @param exposures_us  by camera: two exposures, the shorter first, or none for a camera that takes one; may be
  ///                      shorter than the cameras
  /// @param texture_cameras  how many of the last cameras serve for colour alone
  Rig(std::unique_ptr<Projector> projector, std::vector<std::unique_ptr<Camera>> cameras, Grey8 image,
      const ScanOptions& options, const std::vector<std::vector<double>>& exposures_us = {},
      std::size_t texture_cameras = 0);

  /// Opens the projector and shows the current picture; notices a lost projector.
  void supervise() { projection_.supervise(); }
  /// The time when supervise() next has work while no device is lost; the end of time if it has none.
  [[nodiscard]] MonotonicTime next_change() const { return projection_.next_change(); }

  /// Tells whether all cameras that measure replay images at the trigger. Then only the processor limits the rate.
  [[nodiscard]] bool only_replays() const;

  /// Takes one frame of each camera. If cameras run freely, takes the frames with the closest exposures. Takes lost
  /// frames again if the limit allows. Cameras with two exposures then take the longer one together, of each picture.
  /// @param exposure  kNext: a frame may have begun before the call, but after the pattern was visible and after the
  ///                  previous capture's frames
  /// @param light     exposed after the pattern's frames, white first, each once its own picture is visible. With
  ///                  colour, texture cameras expose as well; their exposures may lie apart from those of others
  /// @errors kTimeout: a device is not ready; kFrameDropped, kFrameTorn, kFrameStale, kFrameLate, kMismatch,
  ///         kDisconnected, kBusy: of one camera; kFrameSkewed: exposures too far apart; kCancelled
  [[nodiscard]] Result<FrameSet> capture(const WaitLimit& limit, Exposure exposure = Exposure::kFresh,
                                         LightFrames light = {});

  /// Takes one frame of one camera while the pattern is visible. @errors as capture()
  /// @param camera    its index
  /// @param as_shown  keep the projector's picture, whatever it is, instead of the pattern
  [[nodiscard]] Result<Frame> capture_one(std::size_t camera, const WaitLimit& limit, bool as_shown = false);

  /// Shows another pattern from the next capture on.
  void show(Grey8 image) { projection_.set_pattern(std::move(image)); }
  /// Sets the picture shown when nobody has scanned for a while. Without a picture the pattern stays.
  void set_idle(std::optional<Grey8> picture, std::chrono::milliseconds after) {
    projection_.set_idle(std::move(picture), after);
  }
  /// Shows a picture at once, until the next capture, hold() or release(). @param picture  nothing: the pattern
  /// @errors kTimeout: the projector is not ready; kCancelled; the previous picture then stays
  [[nodiscard]] Result<> hold(const std::optional<Grey8>& picture, const WaitLimit& limit);
  /// Shows the idle picture at once. @errors as hold()
  [[nodiscard]] Result<> release(const WaitLimit& limit);

  /// Replaces a camera as CameraRunner::replace() does. @param camera  its index @thread thread-safe
  [[nodiscard]] Result<> replace(std::size_t camera, std::unique_ptr<Camera> next, std::unique_ptr<Camera> otherwise,
                                 MonotonicTime deadline) {
    return runners_[camera]->replace(std::move(next), std::move(otherwise), deadline);
  }

  void request_stop();
  /// Tells whether the cameras are closed after request_stop().
  [[nodiscard]] bool stopped() const;
  /// Tells whether the cameras' threads keep their promises to the watchdog.
  [[nodiscard]] bool kept(MonotonicTime now = std::chrono::steady_clock::now()) const;
  [[nodiscard]] DeviceStatus projector_status() const { return projection_.status(); }
  [[nodiscard]] std::vector<DeviceStatus> camera_statuses() const;
  [[nodiscard]] RigStatus status() const { return {projector_status(), camera_statuses()}; }
  /// The number of times that any device was opened. When it grows, a device may have been replaced.
  [[nodiscard]] std::uint64_t openings() const;

 private:
  using Cameras = std::span<CameraRunner* const>;
  /// The conditions under which one set of frames is exposed.
  struct Shot {
    const WaitLimit& limit;
    Exposure exposure = Exposure::kFresh;
    Picture light = Picture::kPattern;
    std::size_t round = 0;  ///< index of the exposure, if cameras take several
  };
  template <class Show>
  [[nodiscard]] Result<> show(const WaitLimit& limit, Show show);
  [[nodiscard]] Cameras measuring() const { return Cameras(cameras_).first(measuring_); }
  [[nodiscard]] Result<> take_picture(Cameras cameras, const Shot& shot, FrameSet& set);
  [[nodiscard]] Result<std::vector<Frame>> take_set(Cameras cameras, const Shot& shot);
  [[nodiscard]] Result<std::vector<Frame>> expose(Cameras cameras, const Shot& shot);
  [[nodiscard]] Result<std::vector<Frame>> collect(Cameras cameras, const WaitLimit& limit);
  [[nodiscard]] Result<> align(Cameras cameras, std::span<Frame> frames, const Shot& shot);
  [[nodiscard]] std::chrono::nanoseconds slack(const CameraRunner& camera) const;
  [[nodiscard]] Result<> check_times(Cameras cameras, const std::vector<Frame>& frames, MonotonicTime since,
                                     MonotonicTime deadline) const;
  [[nodiscard]] Result<> check_skew(Cameras cameras, std::span<const Frame> frames) const;

  Projection projection_;
  std::vector<std::unique_ptr<CameraRunner>> runners_;
  std::vector<CameraRunner*> cameras_;
  std::size_t measuring_;  ///< number of the first cameras that measure
  std::vector<CameraRunner*> of_two_exposures_;
  ScanOptions options_;
  std::uint64_t changes_before_ = 0;  ///< the projection's count of changes at the last set of frames
  std::stop_source stopping_;
};

}  // namespace slsd
