// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/configure_chunks.hpp"

namespace slsd {
namespace {

/// Whether the chunk is on now, and can be read.
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
  // A camera without a gain in decibels tells it in steps.
  const auto gain = features.has("Gain") ? turn_on(features, "Gain", "ChunkGain") : Result<bool>(false);
  if (!gain) return tl::unexpected(gain.error());
  return ChunkSelection{*timestamp, *exposure_time, *gain};
}

}  // namespace

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

}  // namespace slsd
