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

/// Tells when a buffer's exposure began, from the driver's stamp and the flags that say what it stands for:
///
///     exposure begins ----exposure----> ends, read-out begins ----readout----> last byte
///     TSTAMP_SRC_SOE                    uvcvideo's stamp                       TSTAMP_SRC_EOF
///
/// uvcvideo claims the start of exposure and stamps a frame's first packet, which comes after it. What is not known
/// counts as long as it can be, a frame's period: a frame may be taken for older than it is, never for younger.
///
/// Without a stamp of CLOCK_MONOTONIC only the order is left: when a frame is received says nothing, because who
/// receives it may have slept. Then as many frames as may be in flight have to pass after the trigger. So it is where
/// a driver claims CLOCK_MONOTONIC and stamps by another: uvcvideo with clock=realtime, which is far in the future, or
/// a clock that stands still.
/// @thread thread-bound
class ExposureClock {
 public:
  ExposureClock() = default;
  /// @param driver  as V4l2Device::driver()
  ExposureClock(const ExposureTiming& timing, const V4l2CameraOptions& options, const std::string& driver);

  /// Looks at the stamp of each buffer that is taken, in their order: one that cannot be makes all worthless.
  /// @param received  when it was taken from the driver
  void note(const v4l2_buffer& buffer, MonotonicTime received);
  /// Tells whether nothing was found wrong with the driver's clock.
  [[nodiscard]] bool is_trusted() const { return trusted_; }

  /// The buffer carries a stamp that tells.
  [[nodiscard]] bool is_stamped(const v4l2_buffer& buffer) const;

  /// The start of the buffer's exposure; a guess without a stamp. @param received  when it was taken from the driver
  [[nodiscard]] MonotonicTime exposure_start(const v4l2_buffer& buffer, MonotonicTime received) const;

  /// The greatest number of frames that are exposed or read out at a time.
  [[nodiscard]] int frames_in_flight() const;

  /// The greatest age of an exposure after which the next frame is still current: a few periods.
  [[nodiscard]] std::chrono::nanoseconds next_frame_age_max() const;

  /// The longest silence of a live stream that runs freely: so many frames, and a second at least.
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
