// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"

namespace slsd {
namespace {

tl::unexpected<Error> refuse(const char* message) {
  return fail(ErrorCode::kInvalidArgument, message);
}

bool outside(const std::optional<double>& value, double low, double high) {
  return value && !(*value >= low && *value <= high);
}

}  // namespace

std::filesystem::path V4l2CameraOptions::device_path() const {
  return device.has_parent_path() ? device : std::filesystem::path("/dev/v4l/by-id") / device;
}

Result<> V4l2CameraOptions::validate() const {
  if (name.empty()) return refuse("name must not be empty");
  if (device.empty()) return refuse("device must name a camera, as in /dev/v4l/by-id/...");
  if (format.size() > 4) return refuse("format must be at most four letters, as in GREY");
  if (size_px && (size_px->first < 1 || size_px->second < 1))
    return refuse("width_px and height_px must be at least 1");
  if (outside(frame_rate_hz, 0.01, 10000.0)) return refuse("frame_rate_hz must be 0.01 to 10000");
  if (outside(exposure_us, 1.0, 1e7)) return refuse("exposure_us must be 1 to 10000000");
  if (outside(gain_db, 0.0, 60.0)) return refuse("gain_db must be 0 to 60");
  if (gain_db && gain_steps) return refuse("gain_db and gain_steps both set the gain; leave one out");
  if (power_line_hz && *power_line_hz != 0 && *power_line_hz != 50 && *power_line_hz != 60)
    return refuse("power_line_hz must be 0, 50 or 60");
  if (outside(readout_us, 0.0, 1e7)) return refuse("readout_us must be 0 to 10000000");
  if (settle_frames < 0 || settle_frames > 100) return refuse("settle_frames must be 0 to 100");
  if (frames_held_max < 2 || frames_held_max > 24) return refuse("frames_held_max must be 2 to 24");
  if (missed_frames_max < 0 || missed_frames_max > 100) return refuse("missed_frames_max must be 0 to 100");
  if (automatic && exposure_us) return refuse("exposure_us cannot be set while automatic is true");
  if (automatic && gain_db) return refuse("gain_db cannot be set while automatic is true");
  if (automatic && gain_steps) return refuse("gain_steps cannot be set while automatic is true");
  if (automatic && focus_steps) return refuse("focus_steps cannot be set while automatic is true");
  return {};
}

}  // namespace slsd
