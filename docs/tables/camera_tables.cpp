// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/configuration_table.hpp"

namespace slsd {
namespace {

constexpr KeyValue kExample = KeyValue::kExample, kOptional = KeyValue::kOptional;

ConfigurationTable every_camera() {
  return {
      "camera",
      "One table per camera. Without a camera, the service runs but cannot scan.",
      {{{{"name", R"("camera")"}}, "The camera's name, as in the calibration. Each camera has its own."},
       {{{"driver", R"("file")"}}, R"("file" replays images. "v4l2" and "aravis" are for devices.)"},
       {{{"use", R"("points")"}},
        R"("points": the camera is decoded. "texture": it gives only the colours of points that other cameras measure.)"},
       {{{"exposures_us", "[2000, 8000]", kOptional}},
        "Two exposures for each picture, 1 to 1000000, instead of exposure_us: the shorter, then one 1.5 to 100 times "
        "as "
        "long. slsd merges the two frames, for still scenes with bright and dark parts. A file camera replays its "
        "images as the shorter and the longer exposure in turn."},
       {{{"white_balance", "[1.0, 1.0, 1.0]"}},
        "Factors of red, green and blue in clouds with colour, 0.1 to 10. docs/hardware.md explains how to measure "
        "them."},
       {{{"faults", "[]"}},
        "Faults to simulate in tests, as KIND@CAPTURE or KIND@CAPTURE:DURATION, such as "
        R"(["drop@3", "late@5:200ms", "disconnect@7:1.5s"]. The kinds are drop, tear, late, stale, stall, hang and )"
        "disconnect."}}};
}

ConfigurationTable file_camera() {
  return {
      "camera.file",
      "",
      {{{{"path", R"("frames")", kExample}},
        "A folder of PNG, TIFF, PGM, PPM or JPEG images, replayed in the order of their names, or one image. Frames "
        R"(for scans with texture or ambient light come from its folders "white" and "dark", or those beside the one )"
        "image."},
       {{{"loop", "true"}}, "Start again after the last image. If false, the camera then has no more frames."},
       {{{"rate_hz", "0.0", {}, "0.001", "1000"}},
        "0: one image per trigger; else this many images per second, {rate_hz}."},
       {{{"width_px", "1600", kOptional}, {"height_px", "1200", kOptional}},
        "The size that every image must have. Set both or neither. Without these keys, the size of the first image."},
       {{{"bayer", R"("none")"}}, R"(Grey images are "none", or a mosaic: "RGGB", "BGGR", "GRBG" or "GBRG".)"}}};
}

ConfigurationTable v4l2_camera() {
  return {
      "camera.v4l2",
      "A V4L2 camera, such as a USB camera. slsd reads its settings back, and turns automatic controls off.",
      {{{{"device", R"("/dev/v4l/by-id/usb-maker_camera_serial-video-index0")", kExample}},
        "The device, best by its permanent name in /dev/v4l/by-id. A name without a folder is in that folder."},
       {{{"format", R"("")"}},
        "The pixel format: GREY, Y16, Y12, Y10, a mosaic such as RGGB, YUYV, MJPG and so on. Empty: the camera's best "
        "format for decoding."},
       {{{"width_px", "1600", kOptional}, {"height_px", "1200", kOptional}},
        "The size of its frames. Set both or neither. Without these keys, the largest size."},
       {{{"frame_rate_hz", "60.0", kOptional, "0.01", "10000"}},
        "Frames per second, {frame_rate_hz}. Without this key, slsd leaves the rate unchanged."},
       {{{"exposure_us", "16700.0", kOptional, "1", "10000000"}},
        "The exposure, {exposure_us}, in steps of 100. Without this key, slsd leaves it unchanged. A DLP projector "
        "needs "
        "whole multiples of its frame: 16700 at 60 Hz."},
       {{{"gain_db", "0.0", kOptional, "0", "60"}},
        "Decibels above the camera's least gain, {gain_db}. An error if its driver does not know the unit."},
       {{{"gain_steps", "0", kOptional}, {"focus_steps", "0", kOptional}},
        "Gain and focus in the camera's own steps; v4l2-ctl -l shows the range."},
       {{{"power_line_hz", "50", kOptional}}, "The flicker filter: 0 (none), 50 or 60."},
       {{{"automatic", "false"}}, "Leave automatic exposure, gain, white balance and focus on."},
       {{{"readout_us", "8000.0", kOptional, "0", "10000000"}},
        "The time from the end of the exposure to the frame's last byte, {readout_us}, if the driver stamps that byte. "
        "Without this key, one frame period."},
       {{{"settle_frames", "2", {}, "0", "100"}},
        "Frames to discard after opening, {settle_frames}, because settings take effect after a few frames."},
       {{{"frames_held_max", "8", {}, "2", "24"}}, "The most frames held at once, {frames_held_max}."},
       {{{"missed_frames_max", "3", {}, "0", "100"}},
        "After this many missing frames in a row, {missed_frames_max}, and at least a second, slsd restarts the "
        "stream. 0: "
        "never, for a camera that waits for its trigger input."}}};
}

ConfigurationTable aravis_camera() {
  return {
      "camera.aravis",
      "A GigE Vision or USB3 Vision camera. slsd reads its settings back, and turns automatic controls off.",
      {{{{"id", R"("192.0.2.10")", kExample}},
        R"(Serial number, "vendor-serial" or IPv4 address; slsd --list shows them. slsd finds an address fastest.)"},
       {{{"interface", R"("")"}},
        "The IPv4 address of this host's interface to the camera. Empty: the routing table decides."},
       {{{"trigger", R"("software")"}},
        R"("software": the camera exposes at a command. "line": at a rising edge on an input. "free_run": at its own )"
        R"(rate. "action": several GigE Vision cameras expose at one command.)"},
       {{{"trigger_line", R"("Line1")"}}, R"(With "line": the input.)"},
       {{{"action_device_key", "1", {}, "0", "4294967295"},
         {"action_group_key", "1", {}, "0", "4294967295"},
         {"action_group_mask", "1", {}, "0", "4294967295"}},
        R"(With "action": equal for all cameras that expose together, and unlike all others on the network.)"},
       {{{"action_lead_us", "0.0", {}, "0", "1000000"}},
        "The delay from the command to the exposure, {action_lead_us}, by the clock that ptp synchronises. 0: none."},
       {{{"ptp", "false"}}, "Synchronise the camera's clock with the network (IEEE 1588)."},
       {{{"rate_hz", "0.0", {}, "0.01", "10000"}},
        "Frames per second in free run, {rate_hz}. 0: slsd leaves the rate unchanged."},
       {{{"device_clock", R"("auto")"}},
        R"(The clock that times exposures. "auto": the camera's, or the arrival of frames if that clock is unreliable. )"
        R"("device": always the camera's. "arrival": never.)"},
       {{{"readout_us", "0.0", {}, "0", "10000000"}},
        "If slsd times frames by arrival without a software trigger: the longest time from the end of an exposure to "
        "its "
        "frame, {readout_us}. 0: two frame periods."},
       {{{"exposure_us", "10000.0", {}, "1", "10000000"}},
        "The exposure, {exposure_us}. A DLP projector needs whole multiples of its frame: 16667 at 60 Hz."},
       {{{"gain_db", "0.0", {}, "0", "60"}}, "The gain, {gain_db}."},
       {{{"pixel_format", R"("Mono8")"}},
        "Mono8, Mono10, Mono12, Mono16; Mono10p, Mono12p, Mono10Packed, Mono12Packed; or a mosaic such as BayerRG8: "
        "BayerGR, BayerRG, BayerGB or BayerBG with 8, 10, 12 or 16 bits."},
       {{{"width_px", "1600", kOptional}, {"height_px", "1200", kOptional}},
        "The size of a region in the sensor's middle. Set both or neither. Without these keys, the whole sensor."},
       {{{"chunks", "true"}},
        "Ask the camera for each frame's time, exposure and gain (chunk data), if it can send them. A scan then fails "
        "if "
        "a frame's exposure or gain differs from the configuration."},
       {{{"packet_bytes", "0", {}, "576", "16000"}},
        "GigE Vision: bytes of a packet with its headers, {packet_bytes}. 0: the largest that the network passes."},
       {{{"packet_delay_us", "0.0", {}, "0", "1000000"}},
        "GigE Vision: the pause between two packets, {packet_delay_us}, for several cameras on one link."},
       {{{"receive_buffer_bytes", "0", {}, "0", "1073741824"}},
        "GigE Vision: the socket's buffer, which net.core.rmem_max must allow, {receive_buffer_bytes}. 0: two frames."},
       {{{"packet_resend", "true"}}, "GigE Vision: request lost packets again."},
       {{{"packet_socket", "true"}},
        "GigE Vision: read packets through a packet socket instead of UDP. It loses fewer, and needs CAP_NET_RAW."},
       {{{"frame_timeout_ms", "1000", {}, "10", "60000"}, {"missed_frames_max", "2", {}, "1", "100"}},
        "The longest time from an exposure to its frame, {frame_timeout_ms}. After this many missing frames in a row, "
        "{missed_frames_max}, slsd reopens the camera."},
       {{{"frames_held_max", "8", {}, "2", "64"}}, "The most frames held at once, {frames_held_max}."}}};
}

}  // namespace

std::vector<ConfigurationTable> camera_tables() {
  return {every_camera(), file_camera(), v4l2_camera(), aravis_camera()};
}

}  // namespace slsd
