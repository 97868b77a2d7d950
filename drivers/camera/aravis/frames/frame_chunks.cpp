// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/frame_chunks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drivers/camera/aravis/device/device_clock.hpp"

namespace slsd {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kTagBytes = 4 + kLengthBytes;
constexpr std::size_t kWordBytes = 4;

std::size_t length_before(std::span<const std::uint8_t> bytes, std::size_t end, std::endian order) {
  std::size_t length = 0;
  for (std::size_t i = 0; i < kLengthBytes; ++i) {
    const std::size_t at = order == std::endian::big ? end - kLengthBytes + i : end - 1 - i;
    length = length << 8 | bytes[at];
  }
  return length;
}

// Twice the tolerance of configuring: sensors add a constant to their setting.
constexpr double kExposureToleranceShare = 0.02;
constexpr double kExposureToleranceUs = 40.0;
constexpr double kGainToleranceDb = 0.2;
constexpr std::uint64_t kLongest = 1ull << 62;  // 146 years in nanoseconds

std::string difference(const char* what, double taken, double configured, const char* unit) {
  char text[128];
  std::snprintf(text, sizeof(text), "its %s was %.10g %s, but %.10g is configured", what, taken, unit, configured);
  return text;
}

bool is_nearer(nanoseconds a, nanoseconds b, nanoseconds to) {
  return std::chrono::abs(a - to) < std::chrono::abs(b - to);
}

}  // namespace

bool is_image_with_chunks(std::span<const std::uint8_t> frame, std::size_t image_bytes, std::endian order) {
  for (std::size_t end = frame.size(); end >= image_bytes + kTagBytes;) {
    const std::size_t length = length_before(frame, end, order);
    if (length > end - kTagBytes) return false;
    end -= kTagBytes + length;
    if (end == 0) return length >= image_bytes && length < image_bytes + kWordBytes;
  }
  return false;
}

std::string unlike_configured(const FrameChunks& chunks, const AravisCameraOptions& options) {
  const double share = options.exposure_us * kExposureToleranceShare;
  const double tolerance = std::min(std::max(kExposureToleranceUs, share), options.exposure_us / 2);
  // Written so that NaN is refused.
  if (chunks.exposure_us && !(std::abs(*chunks.exposure_us - options.exposure_us) <= tolerance))
    return difference("exposure", *chunks.exposure_us, options.exposure_us, "us");
  if (chunks.gain_db && !(std::abs(*chunks.gain_db - options.gain_db) <= kGainToleranceDb))
    return difference("gain", *chunks.gain_db, options.gain_db, "dB");
  return {};
}

std::optional<nanoseconds> chunk_time(std::uint64_t value, nanoseconds frame_stamp, std::uint64_t tick_frequency_hz,
                                      nanoseconds apart_max) {
  // An impossible time would not fit.
  if (value > kLongest || frame_stamp < nanoseconds(0)) return std::nullopt;
  const nanoseconds plain(static_cast<nanoseconds::rep>(value));
  const bool ticks = tick_frequency_hz > 0 && value / tick_frequency_hz < kLongest / 1'000'000'000;
  const nanoseconds ticked = ticks ? from_ticks(value, tick_frequency_hz) : plain;
  const nanoseconds time = is_nearer(ticked, plain, frame_stamp) ? ticked : plain;
  return std::chrono::abs(time - frame_stamp) <= apart_max ? std::optional(time) : std::nullopt;
}

}  // namespace slsd
