// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/cloud/cloud.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd {

/// Writes binary little-endian PLY as in docs/formats.md.
/// @param base_from_rig  takes the points into the robot's base; null: they stay in the rig's frame
[[nodiscard]] std::string write_ply(const Cloud& cloud, const RigidTransform* base_from_rig = nullptr);

/// Reads the output of write_ply, and no other PLY. Takes points of the robot's base back into the rig's frame.
/// @errors kMalformed
[[nodiscard]] Result<Cloud> read_ply(std::string_view bytes, std::string_view name);

}  // namespace slsd
