// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/aravis_keys.hpp"

#include <array>
#include <span>
#include <string_view>
#include <utility>

namespace slsd {
namespace {

using namespace std::string_view_literals;

constexpr std::array kTriggers{
    std::pair("software"sv, AravisTrigger::kSoftware), std::pair("line"sv, AravisTrigger::kLine),
    std::pair("free_run"sv, AravisTrigger::kFreeRun), std::pair("action"sv, AravisTrigger::kAction)};

}  // namespace

void read_aravis_keys(TableReader& reader, AravisCameraOptions& options) {
  reader.read("id", options.id);
  reader.read("interface", options.interface);
  reader.choose("trigger", options.trigger, std::span<const std::pair<std::string_view, AravisTrigger>>(kTriggers));
  reader.read("trigger_line", options.trigger_line);
  reader.read("action_device_key", options.action.device_key);
  reader.read("action_group_key", options.action.group_key);
  reader.read("action_group_mask", options.action.group_mask);
  reader.read("action_lead_us", options.action_lead_us);
  reader.read("ptp", options.ptp);
  reader.read("rate_hz", options.rate_hz);
  reader.read("exposure_us", options.exposure_us);
  reader.read("gain_db", options.gain_db);
  reader.read("pixel_format", options.pixel_format);
  reader.read_both("width_px", "height_px", options.size_px);
  reader.read("chunks", options.chunks);
  reader.read("packet_bytes", options.packet_bytes);
  reader.read("packet_delay_us", options.packet_delay_us);
  reader.read("receive_buffer_bytes", options.receive_buffer_bytes);
  reader.read("packet_resend", options.packet_resend);
  reader.read("packet_socket", options.packet_socket);
  reader.read("frame_timeout_ms", options.frame_timeout_ms);
  reader.read("missed_frames_max", options.missed_frames_max);
  reader.read("frames_held_max", options.frames_held_max);
}

}  // namespace slsd
