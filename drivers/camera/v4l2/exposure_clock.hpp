// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
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
/// uvcvideo claims the start of exposure and stamps a frame's first packet, which comes after it. A stamp of another
/// clock, or none, counts as the end of the frame when it was received. What is not known counts as long as it can be,
/// a frame's period: a frame may be taken for older than it is, never for younger.
/// @thread reentrant
class ExposureClock {
 public:
  ExposureClock() = default;
  /// @param driver  as V4l2Device::driver()
  ExposureClock(const ExposureTiming& timing, const V4l2CameraOptions& options, const std::string& driver);

  /// @param received  when it was taken from the driver
  [[nodiscard]] MonotonicTime exposure_start(const v4l2_buffer& buffer, MonotonicTime received) const;

 private:
  std::chrono::nanoseconds exposure_{0};
  std::chrono::nanoseconds readout_{0};
  bool stamps_first_packet_ = false;
};

}  // namespace slsd
