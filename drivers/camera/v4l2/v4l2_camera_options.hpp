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

/// The keys of a [[camera]] table whose driver is "v4l2". What is not given stays as the device has it, except that
/// everything automatic is turned off.
struct V4l2CameraOptions {
  static constexpr std::string_view kDriver = "v4l2";
  std::string name = "camera";
  std::filesystem::path device = {};  ///< "/dev/v4l/by-id/...", or a name in that folder; /dev/videoN may renumber
  std::string format = {};            ///< a pixel format as "GREY", "Y16", "YUYV", "MJPG"; empty: the best for decoding
  std::optional<std::pair<int, int>> size_px = {};  ///< width and height; without it the largest of the format
  std::optional<double> frame_rate_hz = {};         ///< held to 1 %
  std::optional<double> exposure_us = {};           ///< rounded to the device's step, for UVC 100 us
  std::optional<double> gain_db = {};   ///< above the camera's least, 0 to 60; held to 0.5 dB where its gain has a unit
  std::optional<int> gain_steps = {};   ///< the device's own steps: V4L2 does not tell what one is worth
  std::optional<int> focus_steps = {};  ///< the device's own steps
  std::optional<int> power_line_hz = {};  ///< 0 (no filter), 50 or 60
  bool automatic = false;                 ///< true leaves automatic exposure, gain, white balance and focus as they are
  std::optional<double> readout_us = {};  ///< time from the exposure's end to a frame's last byte, if the device stamps
                                          ///< the end; without it a frame's period, which is safe but may cost a frame
  int settle_frames = 2;                  ///< discarded after open(), 0 to 100: exposed under the settings before
  int frames_held_max = 8;                ///< number of frames that may be held at once, 2 to 24
  int missed_frames_max = 3;  ///< so many in a row missing, and a second at least: the stream is dead, 0 to 100; 0 for
                              ///< a camera that a signal triggers, whose silence says nothing

  /// The path of the device node, or of the link to it.
  [[nodiscard]] std::filesystem::path device_path() const;
  /// @errors kInvalidArgument: the message begins with the key
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const V4l2CameraOptions&, const V4l2CameraOptions&) = default;
};

}  // namespace slsd
