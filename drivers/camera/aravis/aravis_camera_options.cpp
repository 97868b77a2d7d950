// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_camera_options.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cstdint>

#include "drivers/camera/aravis/frames/pixel_layout.hpp"

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

tl::unexpected<Error> refuse(std::string message) {
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

bool within(double value, double low, double high) {
  return value >= low && value <= high;
}

bool is_address(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

constexpr milliseconds kFirstFrame{250};   // readout and transfer
constexpr milliseconds kLaterFrame{3000};  // for the slowest camera on a busy network
constexpr int kWaysToOpen = 2;             // with chunks, and without
constexpr milliseconds kPeriodUnknown{100};
constexpr int kPeriodsToNext = 5;         // one period is for readout and transfer
constexpr milliseconds kPauseLeast{100};  // a busy host may pause this long

/// The longest time from the trigger to the end of the exposure.
nanoseconds exposure_time(const AravisCameraOptions& options) {
  const double period_us = options.rate_hz > 0.0 ? 1e6 / options.rate_hz : 0.0;
  return from_us(options.exposure_us + options.action_lead_us + period_us);
}

}  // namespace

bool AravisCameraOptions::names_address() const {
  return is_address(id);
}

Result<> AravisCameraOptions::validate() const {
  if (name.empty()) return refuse("name must not be empty");
  if (id.empty())
    return refuse("id must be the camera's serial number, vendor-serial or address; slsd --list shows them");
  if (!interface.empty() && !is_address(interface)) return refuse("interface must be an IPv4 address of this host");
  if (trigger == AravisTrigger::kLine && trigger_line.empty()) return refuse("trigger_line must name an input");
  if (trigger == AravisTrigger::kAction && action.group_mask == 0)
    return refuse("action_group_mask must have at least one bit if trigger is \"action\"");
  if (!within(action_lead_us, 0.0, 1e6)) return refuse("action_lead_us must be 0 to 1000000");
  if (action_lead_us > 0.0 && !ptp) return refuse("action_lead_us needs ptp = true, so that the clocks agree");
  if (rate_hz != 0.0 && !within(rate_hz, 0.01, 10000.0)) return refuse("rate_hz must be 0, or 0.01 to 10000");
  if (!within(readout_us, 0.0, 1e7)) return refuse("readout_us must be 0 to 10000000");
  if (!within(exposure_us, 1.0, 1e7)) return refuse("exposure_us must be 1 to 10000000");
  if (!within(gain_db, 0.0, 60.0)) return refuse("gain_db must be 0 to 60");
  if (!find_pixel_layout(pixel_format)) return refuse("pixel_format must be one of " + pixel_format_names());
  if (size_px && (size_px->first < 1 || size_px->second < 1))
    return refuse("width_px and height_px must be at least 1");
  if (packet_bytes != 0 && !within(packet_bytes, 576, 16000)) return refuse("packet_bytes must be 0, or 576 to 16000");
  if (!within(packet_delay_us, 0.0, 1e6)) return refuse("packet_delay_us must be 0 to 1000000");
  if (!within(receive_buffer_bytes, 0, 1 << 30)) return refuse("receive_buffer_bytes must be 0 to 1073741824");
  if (!within(frame_timeout_ms, 10, 60000)) return refuse("frame_timeout_ms must be 10 to 60000");
  if (!within(missed_frames_max, 1, 100)) return refuse("missed_frames_max must be 1 to 100");
  if (!within(frames_held_max, 2, 64)) return refuse("frames_held_max must be 2 to 64");
  return {};
}

nanoseconds from_us(double duration_us) {
  return nanoseconds(static_cast<std::int64_t>(duration_us * 1e3));
}

nanoseconds frame_timeout(const AravisCameraOptions& options) {
  return milliseconds(options.frame_timeout_ms) + exposure_time(options);
}

nanoseconds first_frame_timeout(const AravisCameraOptions& options, AravisTrigger trigger, int tries_before) {
  const double period_us = trigger == AravisTrigger::kFreeRun && options.rate_hz > 0.0 ? 1e6 / options.rate_hz : 0.0;
  const milliseconds transfer = tries_before == 0 ? kFirstFrame : kLaterFrame;
  return std::min(milliseconds(options.frame_timeout_ms), transfer) + from_us(options.exposure_us + period_us);
}

nanoseconds first_frame_time_max(const AravisCameraOptions& options) {
  nanoseconds time{0};
  for (int i = 0; i < kFirstFrameTries; ++i) time += first_frame_timeout(options, options.trigger, i);
  return kWaysToOpen * time;
}

nanoseconds next_frame_age_max(const AravisCameraOptions& options) {
  const nanoseconds period = options.rate_hz > 0.0 ? from_us(1e6 / options.rate_hz) : kPeriodUnknown;
  return from_us(options.exposure_us) + std::max<nanoseconds>(kPeriodsToNext * period, kPauseLeast);
}

}  // namespace slsd
