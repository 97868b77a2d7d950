// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "drivers/camera/frame.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"
#include "drivers/camera/v4l2/v4l2_controls.hpp"

struct v4l2_buffer;

namespace slsd {

/// Computes when a buffer's exposure began, from the driver's stamp and the flags that give its meaning:
///
///     exposure begins ----exposure----> ends, read-out begins ----readout----> last byte
///     TSTAMP_SRC_SOE                    uvcvideo's stamp                       TSTAMP_SRC_EOF
///
/// uvcvideo claims to stamp the start of exposure, but stamps a frame's first packet, which comes later. An unknown
/// time counts as its maximum, one frame period. So a frame may seem older than it is, but never younger.
///
/// Without a CLOCK_MONOTONIC stamp, only the order of frames remains. The time of receipt proves nothing, because the
/// receiver may have slept. So after the trigger, all frames that may be in flight must pass first. The same holds if a
/// driver claims CLOCK_MONOTONIC but uses another clock: uvcvideo with clock=realtime, which is far in the future, or a
/// clock that stands still.
/// @thread thread-bound
class ExposureClock {
 public:
  ExposureClock() = default;
  /// @param driver  as V4l2Device::driver()
  ExposureClock(const ExposureTiming& timing, const V4l2CameraOptions& options, const std::string& driver);

  /// Notes another exposure for the next frames.
  void set_exposure(const ExposureTiming& timing) { exposure_ = timing.exposure.value_or(period_); }

  /// Checks the stamp of each taken buffer, in order. One impossible stamp makes all stamps untrusted.
  /// @param received  when the buffer was taken from the driver
  void note(const v4l2_buffer& buffer, MonotonicTime received);
  /// Tells whether the driver's clock has shown no fault.
  [[nodiscard]] bool is_trusted() const { return trusted_; }

  /// Tells whether the buffer carries a usable stamp.
  [[nodiscard]] bool is_stamped(const v4l2_buffer& buffer) const;

  /// The start of the buffer's exposure; an estimate without a stamp. @param received  when the buffer was taken from
  /// the driver
  [[nodiscard]] MonotonicTime exposure_start(const v4l2_buffer& buffer, MonotonicTime received) const;

  /// The greatest number of frames in exposure or readout at a time.
  [[nodiscard]] int frames_in_flight() const;

  /// The greatest age of an exposure at which the next frame is still current: a few periods.
  [[nodiscard]] std::chrono::nanoseconds next_frame_age_max() const;

  /// The longest silence of a live stream in free run: this many frames, and at least one second.
  [[nodiscard]] std::chrono::nanoseconds silence_max(int missed_frames_max) const;

 private:
  std::chrono::nanoseconds period_{1};
  std::chrono::nanoseconds exposure_{0};
  std::chrono::nanoseconds readout_{0};
  bool stamps_first_packet_ = false;
  bool trusted_ = true;
  std::chrono::nanoseconds last_stamp_{0};
  std::uint32_t last_sequence_ = 0;
  int same_stamps_ = 0;  ///< equal stamps in a row
};

}  // namespace slsd
