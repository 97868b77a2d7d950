// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/v4l2_keys.hpp"

#include <string>

namespace slsd {

void read_v4l2_keys(TableReader& reader, V4l2CameraOptions& options) {
  std::string device = options.device.string();
  reader.read("device", device);  // not a path: a bare name is one of /dev/v4l/by-id
  options.device = device;
  reader.read("format", options.format);
  reader.read_both("width_px", "height_px", options.size_px);
  reader.read("frame_rate_hz", options.frame_rate_hz);
  reader.read("exposure_us", options.exposure_us);
  reader.read("gain_db", options.gain_db);
  reader.read("gain_steps", options.gain_steps);
  reader.read("focus_steps", options.focus_steps);
  reader.read("power_line_hz", options.power_line_hz);
  reader.read("automatic", options.automatic);
  reader.read("readout_us", options.readout_us);
  reader.read("settle_frames", options.settle_frames);
  reader.read("frames_held_max", options.frames_held_max);
  reader.read("missed_frames_max", options.missed_frames_max);
}

}  // namespace slsd
