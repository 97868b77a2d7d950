// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_controls.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace slsd {
namespace {

constexpr double kUnitUs = 100.0;  // of EXPOSURE_ABSOLUTE
constexpr double kRateTolerance = 0.01;

/// A control with its key in the configuration.
struct Setting {
  const char* key;
  __u32 id;
};

/// Off for all of these is 0.
constexpr std::array kAutomatic{__u32{V4L2_CID_EXPOSURE_AUTO_PRIORITY}, __u32{V4L2_CID_AUTOGAIN},
                                __u32{V4L2_CID_AUTO_WHITE_BALANCE},     __u32{V4L2_CID_FOCUS_AUTO},
                                __u32{V4L2_CID_AUTOBRIGHTNESS},         __u32{V4L2_CID_HUE_AUTO},
                                __u32{V4L2_CID_WIDE_DYNAMIC_RANGE}};

std::optional<v4l2_queryctrl> query(const V4l2Device& device, __u32 id) {
  v4l2_queryctrl description{};
  description.id = id;
  if (device.call(VIDIOC_QUERYCTRL, &description) != 0) return std::nullopt;
  if ((description.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0) return std::nullopt;
  return description;
}

std::string name_of(const v4l2_queryctrl& control) {
  return "the control \"" + std::string(reinterpret_cast<const char*>(control.name)) + "\"";
}

std::optional<int> read_control(const V4l2Device& device, __u32 id) {
  v4l2_control control{};
  control.id = id;
  if (device.call(VIDIOC_G_CTRL, &control) != 0) return std::nullopt;
  return control.value;
}

Result<> write_control(const V4l2Device& device, const v4l2_queryctrl& description, int value) {
  v4l2_control control{};
  control.id = description.id;
  control.value = value;
  if (const int error = device.call(VIDIOC_S_CTRL, &control))
    return device.fail_call(error, "cannot set " + name_of(description) + " to " + std::to_string(value));
  const auto taken = read_control(device, description.id);
  if (taken == value) return {};
  return fail(ErrorCode::kMismatch,
              name_of(description) + " was set to " + std::to_string(value) + " and reads back " +
                  (taken ? std::to_string(*taken) : "nothing") + "; choose a value that the camera takes",
              device.path());
}

// 1 is manual; where a device lacks it, 2 (shutter priority) holds the exposure time too.
Result<> turn_automatic_exposure_off(const V4l2Device& device) {
  const auto control = query(device, V4L2_CID_EXPOSURE_AUTO);
  if (!control) return {};
  auto manual = write_control(device, *control, V4L2_EXPOSURE_MANUAL);
  if (!manual && write_control(device, *control, V4L2_EXPOSURE_SHUTTER_PRIORITY)) return {};
  return manual;
}

Result<> turn_automatic_off(const V4l2Device& device) {
  if (auto off = turn_automatic_exposure_off(device); !off) return off;
  for (const __u32 id : kAutomatic) {
    const auto control = query(device, id);
    if (!control) continue;
    if (auto off = write_control(device, *control, 0); !off) return off;
  }
  return {};
}

Result<> set(const V4l2Device& device, const Setting& setting, double steps) {
  const auto control = query(device, setting.id);
  if (!control) {
    return fail(ErrorCode::kUnsupported, std::string(setting.key) + ": the camera has no such control; leave it out",
                device.path());
  }
  if (!(steps >= control->minimum - 0.5 && steps <= control->maximum + 0.5)) {
    return fail(ErrorCode::kInvalidArgument,
                std::string(setting.key) + ": " + name_of(*control) + " goes from " + std::to_string(control->minimum) +
                    " to " + std::to_string(control->maximum) + ", not to " + std::to_string(std::llround(steps)),
                device.path());
  }
  const double step = control->type == V4L2_CTRL_TYPE_INTEGER ? std::max(control->step, 1) : 1;
  const double on_step = control->minimum + std::round((steps - control->minimum) / step) * step;
  return write_control(device, *control, static_cast<int>(std::min<double>(on_step, control->maximum)));
}

Result<> set_gain(const V4l2Device& device, int steps) {
  const bool analogue = !query(device, V4L2_CID_GAIN) && query(device, V4L2_CID_ANALOGUE_GAIN);
  return set(device, {"gain_steps", analogue ? __u32{V4L2_CID_ANALOGUE_GAIN} : __u32{V4L2_CID_GAIN}}, steps);
}

int power_line_choice(int hz) {
  if (hz == 0) return V4L2_CID_POWER_LINE_FREQUENCY_DISABLED;
  return hz == 50 ? V4L2_CID_POWER_LINE_FREQUENCY_50HZ : V4L2_CID_POWER_LINE_FREQUENCY_60HZ;
}

std::optional<double> rate_hz(const v4l2_streamparm& parameters) {
  const v4l2_fract& time = parameters.parm.capture.timeperframe;
  if (time.numerator == 0 || time.denominator == 0) return std::nullopt;
  return static_cast<double>(time.denominator) / time.numerator;
}

std::string hertz_text(double hz) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g Hz", hz);
  return text;
}

}  // namespace

Result<> set_controls(const V4l2Device& device, const V4l2CameraOptions& options) {
  if (!options.automatic) {
    if (auto off = turn_automatic_off(device); !off) return off;
  }
  Result<> done;
  if (options.power_line_hz)
    done = set(device, {"power_line_hz", V4L2_CID_POWER_LINE_FREQUENCY}, power_line_choice(*options.power_line_hz));
  if (done && options.exposure_us)
    done = set(device, {"exposure_us", V4L2_CID_EXPOSURE_ABSOLUTE}, *options.exposure_us / kUnitUs);
  if (done && options.gain_steps) done = set_gain(device, *options.gain_steps);
  if (done && options.focus_steps) done = set(device, {"focus_steps", V4L2_CID_FOCUS_ABSOLUTE}, *options.focus_steps);
  return done;
}

Result<> set_frame_rate(const V4l2Device& device, const V4l2CameraOptions& options) {
  if (!options.frame_rate_hz) return {};
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1000, static_cast<__u32>(std::llround(1000 * *options.frame_rate_hz))};
  if (const int error = device.call(VIDIOC_S_PARM, &parameters))
    return device.fail_call(error, "frame_rate_hz: cannot set the frame rate");
  const auto taken = rate_hz(parameters);
  if (taken && std::abs(*taken / *options.frame_rate_hz - 1.0) <= kRateTolerance) return {};
  return fail(ErrorCode::kMismatch,
              "frame_rate_hz: asked for " + hertz_text(*options.frame_rate_hz) + " the camera took " +
                  (taken ? hertz_text(*taken) : "nothing") + "; choose a rate that it has at this size",
              device.path());
}

ExposureTiming read_timing(const V4l2Device& device) {
  ExposureTiming timing;
  const auto mode = read_control(device, V4L2_CID_EXPOSURE_AUTO);
  const bool manual = !mode || *mode == V4L2_EXPOSURE_MANUAL || *mode == V4L2_EXPOSURE_SHUTTER_PRIORITY;
  const auto exposure = read_control(device, V4L2_CID_EXPOSURE_ABSOLUTE);
  if (manual && exposure) timing.exposure = std::chrono::microseconds(100) * *exposure;
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device.call(VIDIOC_G_PARM, &parameters) == 0) {
    if (const auto hz = rate_hz(parameters)) timing.period = std::chrono::nanoseconds(std::llround(1e9 / *hz));
  }
  return timing;
}

}  // namespace slsd
