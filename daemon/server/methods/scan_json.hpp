// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/scan/cloud/scan_result.hpp"

namespace slsd {

/// Describes a scan for clients, without its cloud: id, time, number of points, regions by status, times.
[[nodiscard]] nlohmann::json scan_json(const ScanResult& scan, Density density = Density::kSymbols);

/// Adds `base_from_rig`, a 4x4 matrix row by row, to the description of a cloud in the robot's base.
/// @param base_from_rig  null: the cloud is in the rig's frame, and nothing is added
void add_frame(nlohmann::json& about, const RigidTransform* base_from_rig);

/// The rules that rejected regions of a scan, or prevented their restoration, most frequent first. Each comes with its
/// count, its status, its meaning and a remedy.
[[nodiscard]] nlohmann::json reasons_json(const ScanResult& scan);

/// The time since the last byte of a scan's frames, in milliseconds, for its `latency_ms`.
[[nodiscard]] double latency_ms(MonotonicTime received);

/// A frame's size, bit depth, number and times. Includes the camera only if the image names it.
[[nodiscard]] nlohmann::json frame_json(const FrameImage& frame);

}  // namespace slsd
