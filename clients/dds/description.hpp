// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/geometry/calibration.hpp"

namespace slsd::dds {

/// A camera or the projector, as the network names its frame. Optical axes: x right, y down, z forward.
struct Device {
  enum class Kind { kCamera, kProjector };
  Kind kind = Kind::kCamera;
  std::string frame_id;
  RigidTransform rig_from_device;  ///< millimetres
};

/// A name that ROS takes: what it does not take becomes _.
[[nodiscard]] std::string ros_name(std::string name);

/// The frames of a scanner. Clouds are in that of the rig, which is that of the first camera.
[[nodiscard]] std::string rig_frame(const std::string& scanner);
[[nodiscard]] std::string camera_frame(const std::string& scanner, const std::string& camera);
/// The body's: x forward, y left, z up (REP 103). A robot's description says where it is.
[[nodiscard]] std::string body_frame(const std::string& scanner);
[[nodiscard]] RigidTransform body_from_rig();

/// The projector of a calibration: where it stands by the first camera.
[[nodiscard]] Device projector(const std::string& scanner, const Calibration& calibration);
/// All that a calibration has, the projector last.
[[nodiscard]] std::vector<Device> devices(const std::string& scanner, const Calibration& calibration);

/// A robot description (URDF, metres and radians) of a scanner: a link to each frame, in which a box says where the
/// device is. The boxes are symbols; the joints are the calibration's.
/// @param devices  those in the rig frame are its own; none: not calibrated, so only the rig's frame is there
/// @param placed   by extrinsics: the rig's frame is the root; otherwise the body's is
/// @thread reentrant
[[nodiscard]] std::string robot_description(const std::string& scanner, const std::vector<Device>& devices,
                                            bool placed = false);

}  // namespace slsd::dds
