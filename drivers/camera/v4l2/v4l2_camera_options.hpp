// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"

namespace slsd {

/// The keys of a [[camera]] table whose driver is "v4l2". Keys that are not set leave the device's values, except that
/// automatic functions are turned off.
struct V4l2CameraOptions {
  static constexpr std::string_view kDriver = "v4l2";
  std::string name = "camera";
  std::filesystem::path device = {};  ///< "/dev/v4l/by-id/...", or a name in that folder; /dev/videoN may renumber
  std::string format = {};            ///< a pixel format as "GREY", "Y16", "YUYV", "MJPG"; empty: the best for decoding
  std::optional<std::pair<int, int>> size_px = {};  ///< width and height; empty: the format's largest
  std::optional<double> frame_rate_hz = {};         ///< must match within 1 %
  std::optional<double> exposure_us = {};           ///< rounded to the device's step, for UVC 100 us
  std::optional<double> gain_db = {};               ///< above the minimum, 0 to 60; held to 0.5 dB if it has a unit
  std::optional<int> gain_steps = {};               ///< the device's own steps: V4L2 does not define their size
  std::optional<int> focus_steps = {};              ///< the device's own steps
  std::optional<int> power_line_hz = {};            ///< 0 (no filter), 50 or 60
  bool automatic = false;                 ///< true: leave automatic exposure, gain, white balance and focus on
  std::optional<double> readout_us = {};  ///< time from the exposure's end to a frame's last byte, if the device stamps
                                          ///< the end; empty: one frame period, which is safe but may cost a frame
  int settle_frames = 2;                  ///< frames discarded after open(), 0 to 100: they have the earlier settings
  int frames_held_max = 8;                ///< number of frames that may be held at once, 2 to 24
  int missed_frames_max = 3;  ///< the stream is dead after this many missing frames and at least a second, 0 to 100; 0
                              ///< for an externally triggered camera, whose silence proves nothing

  /// The path of the device node, or of the link to it.
  [[nodiscard]] std::filesystem::path device_path() const;
  /// @errors kInvalidArgument: the message begins with the key
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const V4l2CameraOptions&, const V4l2CameraOptions&) = default;
};

}  // namespace slsd
