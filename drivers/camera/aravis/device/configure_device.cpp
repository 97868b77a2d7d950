// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/device/configure_device.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "drivers/camera/aravis/aravis_camera_options.hpp"

namespace slsd {
namespace {

constexpr double kExposureToleranceShare = 0.01;
constexpr double kExposureToleranceUs = 20.0;  // sensors expose whole lines
constexpr double kGainToleranceDb = 0.1;
constexpr double kRateToleranceShare = 0.01;
constexpr double kRateUnknownHz = 10.0;

/// Turns off the camera's automatic adjustments. They would make frames of one scene differ, and so their decoding.
Result<> turn_automatics_off(const DeviceFeatures& features) {
  for (const char* name : {"ExposureAuto", "GainAuto", "BlackLevelAuto", "BalanceWhiteAuto"})
    if (auto done = features.choose_if_there(name, "Off"); !done) return done;
  if (features.has("GammaEnable")) return features.turn("GammaEnable", false);
  return {};
}

Result<> set_extent(const DeviceFeatures& features, const char* size, const char* offset, const char* sensor,
                    std::optional<int> wanted) {
  const bool movable = features.has(offset);
  if (movable)
    if (auto done = features.set(offset, 0); !done) return done;
  const auto whole = features.integer(sensor);
  if (!whole) return tl::unexpected(whole.error());
  const int extent = wanted.value_or(*whole);
  if (auto done = features.set(size, extent); !done) return done;
  // Multiples of 16 suit the step size of all known sensors.
  const int middle = (*whole - extent) / 2 / 16 * 16;
  return movable && middle > 0 ? features.set(offset, middle) : Result<>();
}

Result<> set_region(const DeviceFeatures& features, const AravisCameraOptions& options) {
  std::optional<int> width;
  std::optional<int> height;
  if (options.size_px) width = options.size_px->first, height = options.size_px->second;
  const bool whole = features.has("WidthMax") && features.has("HeightMax");
  if (auto done = set_extent(features, "Width", "OffsetX", whole ? "WidthMax" : "SensorWidth", width); !done)
    return done;
  return set_extent(features, "Height", "OffsetY", whole ? "HeightMax" : "SensorHeight", height);
}

Result<> set_gain(const DeviceFeatures& features, const AravisCameraOptions& options) {
  if (features.has("GainSelector") && features.has_entry("GainSelector", "All"))
    if (auto done = features.choose("GainSelector", "All"); !done) return done;
  if (features.has("Gain")) return features.set("Gain", options.gain_db, kGainToleranceDb);
  if (options.gain_db == 0.0) return {};
  return fail(ErrorCode::kUnsupported, "the camera has no gain in decibels; remove gain_db", "Gain");
}

/// Turns off every trigger, so that none of a former user's remains.
Result<> clear_triggers(const DeviceFeatures& features) {
  for (const char* selector : {"AcquisitionStart", "FrameBurstStart", "ExposureActive", "FrameStart"}) {
    if (features.has("TriggerSelector") && !features.has_entry("TriggerSelector", selector)) continue;
    if (auto done = features.choose_if_there("TriggerSelector", selector); !done) return done;
    if (auto done = features.choose_if_there("TriggerMode", "Off"); !done) return done;
  }
  return {};
}

/// Cameras number their actions from 0 or from 1.
Result<> set_action(const DeviceFeatures& features, const ActionKeys& keys) {
  const bool from_one = features.has_entry("TriggerSource", "Action1");
  if (features.has("ActionSelector"))
    if (auto done = features.set("ActionSelector", from_one ? 1 : 0); !done) return done;
  for (const auto& [name, value] :
       {std::pair("ActionDeviceKey", keys.device_key), std::pair("ActionGroupKey", keys.group_key),
        std::pair("ActionGroupMask", keys.group_mask)})
    if (auto done = features.set(name, value); !done) return done;
  return features.choose("TriggerSource", from_one ? "Action1" : "Action0");
}

Result<> set_rate(const DeviceFeatures& features, const AravisCameraOptions& options) {
  if (options.rate_hz == 0.0) return {};
  if (auto done = features.turn_if_there("AcquisitionFrameRateEnable", true); !done) return done;
  const char* name = features.has("AcquisitionFrameRate") ? "AcquisitionFrameRate" : "AcquisitionFrameRateAbs";
  return features.set(name, options.rate_hz, options.rate_hz * kRateToleranceShare);
}

std::chrono::nanoseconds period_of(const DeviceFeatures& features, const AravisCameraOptions& options) {
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz : features.rate_hz().value_or(kRateUnknownHz);
  return from_us(1e6 / rate_hz);
}

/// Tells whether the chunk is on now, and can be read.
Result<bool> turn_on(const DeviceFeatures& features, const char* chunk, const char* value) {
  if (!features.has_entry("ChunkSelector", chunk)) return false;
  Result<> done = features.choose("ChunkSelector", chunk);
  if (done) done = features.turn("ChunkEnable", true);
  if (done) return features.has(value);
  if (done.error().code == ErrorCode::kDisconnected) return tl::unexpected(done.error());
  return false;
}

Result<ChunkSelection> turn_on_all(const DeviceFeatures& features) {
  const auto timestamp = turn_on(features, "Timestamp", "ChunkTimestamp");
  if (!timestamp) return tl::unexpected(timestamp.error());
  const auto exposure_time = turn_on(features, "ExposureTime", "ChunkExposureTime");
  if (!exposure_time) return tl::unexpected(exposure_time.error());
  // A camera without a gain in decibels reports it in steps.
  const auto gain = features.has("Gain") ? turn_on(features, "Gain", "ChunkGain") : Result<bool>(false);
  if (!gain) return tl::unexpected(gain.error());
  return ChunkSelection{*timestamp, *exposure_time, *gain};
}

constexpr std::size_t kChunkBytesMax = 1 << 16;  // bound for everything that a camera may append

}  // namespace

Result<DeviceLayout> configure_image(const DeviceFeatures& features, const AravisCameraOptions& options) {
  const auto pixels = find_pixel_layout(options.pixel_format);
  if (!pixels)
    return fail(ErrorCode::kInvalidArgument, "is not a pixel format that slsd can read", options.pixel_format);
  // Chunks behind the image would change the size of a frame.
  Result<> done = features.turn_if_there("ChunkModeActive", false);
  if (done) done = set_region(features, options);
  if (done) done = features.choose("PixelFormat", options.pixel_format);
  if (done) done = turn_automatics_off(features);
  if (done) done = features.choose_if_there("ExposureMode", "Timed");
  if (done) done = configure_exposure(features, options.exposure_us);
  if (done) done = set_gain(features, options);
  if (!done) return tl::unexpected(done.error());
  const auto width = features.integer("Width");
  const auto height = features.integer("Height");
  if (!width) return tl::unexpected(width.error());
  if (!height) return tl::unexpected(height.error());
  return DeviceLayout{*width, *height, *pixels, period_of(features, options)};
}

Result<> configure_exposure(const DeviceFeatures& features, double exposure_us) {
  const char* name = features.has("ExposureTime") ? "ExposureTime" : "ExposureTimeAbs";
  const double tolerance = std::max(kExposureToleranceUs, exposure_us * kExposureToleranceShare);
  return features.set(name, exposure_us, std::min(tolerance, exposure_us / 2));
}

Result<> configure_clock(const DeviceFeatures& features, const AravisCameraOptions& options) {
  for (const char* name : {"PtpEnable", "GevIEEE1588"})
    if (features.has(name)) return features.turn(name, options.ptp);
  if (!options.ptp) return {};
  return fail(ErrorCode::kUnsupported, "the camera has no precision time protocol; set ptp = false", "PtpEnable");
}

Result<> configure_trigger(const DeviceFeatures& features, const AravisCameraOptions& options, AravisTrigger trigger) {
  if (auto done = features.choose_if_there("AcquisitionMode", "Continuous"); !done) return done;
  if (auto done = clear_triggers(features); !done) return done;
  if (trigger == AravisTrigger::kFreeRun) return set_rate(features, options);
  // A frame rate would delay triggers.
  if (auto done = features.turn_if_there("AcquisitionFrameRateEnable", false); !done) return done;
  if (auto done = features.choose("TriggerMode", "On"); !done) return done;
  if (trigger == AravisTrigger::kSoftware) return features.choose("TriggerSource", "Software");
  if (trigger == AravisTrigger::kAction) return set_action(features, options.action);
  if (auto done = features.choose_if_there("TriggerActivation", "RisingEdge"); !done) return done;
  return features.choose("TriggerSource", options.trigger_line);
}

Result<ChunkSelection> configure_chunks(const DeviceFeatures& features, const AravisCameraOptions& options) {
  if (!options.chunks || !features.has("ChunkModeActive")) return ChunkSelection{};
  if (auto active = features.turn("ChunkModeActive", true); !active) {
    if (active.error().code == ErrorCode::kDisconnected) return tl::unexpected(active.error());
    return ChunkSelection{};
  }
  auto selection = turn_on_all(features);
  if (!selection || selection->any()) return selection;
  if (auto off = turn_chunks_off(features); !off) return tl::unexpected(off.error());
  return selection;
}

Result<> turn_chunks_off(const DeviceFeatures& features) {
  return features.turn_if_there("ChunkModeActive", false);
}

Result<std::size_t> read_payload_bytes(ArvCamera* camera, const DeviceLayout& layout, const ChunkSelection& chunks) {
  GErrorSlot error;
  const std::size_t payload = arv_camera_get_payload(camera, error.out());
  if (error.failed())
    return fail(error.code(), "the camera does not report its frame size: " + error.message(), "PayloadSize");
  const std::size_t most = layout.bytes() + (chunks.any() ? kChunkBytesMax : 0);
  if (payload >= layout.bytes() && payload <= most) return payload;
  return fail(ErrorCode::kMismatch,
              "the camera sends " + std::to_string(payload) + " bytes per frame, but its size and pixel format make " +
                  std::to_string(layout.bytes()) + "; turn off what it appends",
              "PayloadSize");
}

}  // namespace slsd
