// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/cloud/cloud.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

// The frame of a file's points: that of the rig, or that of the robot's base. A transform base_from_rig means the base.

/// The header's lines that tell the frame, each after the format's mark: "coordinate_frame rig: ..." or
/// "coordinate_frame robot_base: ..." and "base_from_rig ", 12 numbers row by row.
/// @param base_from_rig  null: the rig's
/// @thread reentrant
[[nodiscard]] std::string frame_lines(std::string_view mark, const RigidTransform* base_from_rig);

/// A PCD's line VIEWPOINT: where the rig is in the frame of the points, as place and quaternion w x y z.
[[nodiscard]] std::string viewpoint_line(const RigidTransform* base_from_rig);

/// base_from_rig of a header that frame_lines() wrote; nothing if its points are in the rig's frame.
[[nodiscard]] std::optional<RigidTransform> base_from_rig_of(std::string_view header);

/// A point in another frame.
[[nodiscard]] CloudPoint moved(CloudPoint point, const RigidTransform& there_from_here);

}  // namespace slsd
