// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_controls.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace slsd {
namespace {

constexpr double kUnitUs = 100.0;  // of EXPOSURE_ABSOLUTE
constexpr double kRateTolerance = 0.01;
constexpr double kGainToleranceDb = 0.5;

/// A control with its key in the configuration.
struct Setting {
  const char* key;
  __u32 id;
};

/// 0 turns off each of these.
constexpr std::array kAutomatic{__u32{V4L2_CID_EXPOSURE_AUTO_PRIORITY}, __u32{V4L2_CID_AUTOGAIN},
                                __u32{V4L2_CID_AUTO_WHITE_BALANCE},     __u32{V4L2_CID_FOCUS_AUTO},
                                __u32{V4L2_CID_AUTOBRIGHTNESS},         __u32{V4L2_CID_HUE_AUTO},
                                __u32{V4L2_CID_WIDE_DYNAMIC_RANGE},     __u32{V4L2_CID_ISO_SENSITIVITY_AUTO}};

std::optional<v4l2_queryctrl> query(const V4l2Device& device, __u32 id) {
  v4l2_queryctrl description{};
  description.id = id;
  if (device.call(VIDIOC_QUERYCTRL, &description) != 0) return std::nullopt;
  if ((description.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0) return std::nullopt;
  return description;
}

std::string name_of(const v4l2_queryctrl& control) {
  return "the control \"" + device_text(control.name) + "\"";
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
              name_of(description) + " was set to " + std::to_string(value) + ", but reads back " +
                  (taken ? std::to_string(*taken) : "nothing") + "; choose a value that the camera supports",
              device.path());
}

// 1 is manual; without it, 2 (shutter priority) also fixes the exposure time.
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
                std::string(setting.key) + ": " + name_of(*control) + " takes " + std::to_string(control->minimum) +
                    " to " + std::to_string(control->maximum) + ", not " + std::to_string(std::llround(steps)),
                device.path());
  }
  const double step = control->type == V4L2_CTRL_TYPE_INTEGER ? std::max(control->step, 1) : 1;
  const double on_step = control->minimum + std::round((steps - control->minimum) / step) * step;
  return write_control(device, *control, static_cast<int>(std::min<double>(on_step, control->maximum)));
}

__u32 gain_control(const V4l2Device& device) {
  const bool analogue = !query(device, V4L2_CID_GAIN) && query(device, V4L2_CID_ANALOGUE_GAIN);
  return analogue ? __u32{V4L2_CID_ANALOGUE_GAIN} : __u32{V4L2_CID_GAIN};
}

/// A choice of a menu of ISO sensitivities.
struct Sensitivity {
  int index = 0;
  double gain_db = 0.0;  ///< above the least
};

std::vector<Sensitivity> sensitivities(const V4l2Device& device, const v4l2_queryctrl& control) {
  std::vector<std::pair<int, double>> values;
  for (int i = control.minimum; i <= control.maximum; ++i) {
    v4l2_querymenu item{};
    item.id = control.id;
    item.index = static_cast<__u32>(i);
    if (device.call(VIDIOC_QUERYMENU, &item) == 0 && item.value > 0)
      values.emplace_back(i, static_cast<double>(item.value));
  }
  std::vector<Sensitivity> choices;
  const auto least = std::ranges::min_element(values, {}, &std::pair<int, double>::second);
  for (const auto& [index, value] : values) choices.push_back({index, 20.0 * std::log10(value / least->second)});
  return choices;
}

std::string decibels_text(const std::vector<Sensitivity>& choices) {
  std::string text;
  for (const Sensitivity& choice : choices) {
    char number[32];
    std::snprintf(number, sizeof number, "%s%.1f", text.empty() ? "" : ", ", choice.gain_db);
    text += number;
  }
  return text;
}

tl::unexpected<Error> fail_unit(const V4l2Device& device) {
  const auto gain = query(device, gain_control(device));
  return fail(ErrorCode::kUnsupported,
              gain ? "gain_db: the driver does not say how many dB a step of " + name_of(*gain) +
                         " is; set gain_steps instead, " + std::to_string(gain->minimum) + " to " +
                         std::to_string(gain->maximum)
                   : "gain_db: the camera has no gain; leave it out",
              device.path());
}

// Among the gain controls, V4L2 defines a unit only for this one: ISO sensitivity times 1000.
Result<> set_gain_db(const V4l2Device& device, double gain_db) {
  const auto control = query(device, V4L2_CID_ISO_SENSITIVITY);
  const auto choices = control ? sensitivities(device, *control) : std::vector<Sensitivity>();
  if (choices.empty()) return fail_unit(device);
  const auto off_by = [gain_db](const Sensitivity& choice) { return std::abs(choice.gain_db - gain_db); };
  const auto nearest = std::ranges::min_element(choices, {}, off_by);
  if (off_by(*nearest) <= kGainToleranceDb) return write_control(device, *control, nearest->index);
  return fail(ErrorCode::kInvalidArgument,
              "gain_db: " + name_of(*control) + " has " + decibels_text(choices) + " dB; choose one of these",
              device.path());
}

Result<> set_gain(const V4l2Device& device, const V4l2CameraOptions& options) {
  if (options.gain_db) return set_gain_db(device, *options.gain_db);
  if (!options.gain_steps) return {};
  return set(device, {"gain_steps", gain_control(device)}, *options.gain_steps);
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

Result<> set_exposure(const V4l2Device& device, double exposure_us) {
  return set(device, {"exposure_us", V4L2_CID_EXPOSURE_ABSOLUTE}, exposure_us / kUnitUs);
}

Result<> set_controls(const V4l2Device& device, const V4l2CameraOptions& options) {
  if (!options.automatic) {
    if (auto off = turn_automatic_off(device); !off) return off;
  }
  Result<> done;
  if (options.power_line_hz)
    done = set(device, {"power_line_hz", V4L2_CID_POWER_LINE_FREQUENCY}, power_line_choice(*options.power_line_hz));
  if (done && options.exposure_us) done = set_exposure(device, *options.exposure_us);
  if (done) done = set_gain(device, options);
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
              "frame_rate_hz: asked for " + hertz_text(*options.frame_rate_hz) + ", the camera set " +
                  (taken ? hertz_text(*taken) : "nothing") + "; choose a rate that it offers at this size",
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
