// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/geometry/calibration.hpp"

namespace slsd::dds {

/// A camera or the projector, with its frame in the network. Optical axes: x right, y down, z forward.
struct Device {
  enum class Kind { kCamera, kProjector };
  Kind kind = Kind::kCamera;
  std::string frame_id;
  RigidTransform rig_from_device;  ///< millimetres
};

/// Makes a valid ROS name: invalid characters become _.
[[nodiscard]] std::string ros_name(std::string name);

/// The frame of a scanner's rig, which is the first camera's. Clouds use it.
[[nodiscard]] std::string rig_frame(const std::string& scanner);
[[nodiscard]] std::string camera_frame(const std::string& scanner, const std::string& camera);
/// The frame of the body: x forward, y left, z up (REP 103). A robot's description gives its position.
[[nodiscard]] std::string body_frame(const std::string& scanner);
[[nodiscard]] RigidTransform body_from_rig();

/// The projector of a calibration: its position relative to the first camera.
[[nodiscard]] Device projector(const std::string& scanner, const Calibration& calibration);
/// All devices of a calibration, the projector last.
[[nodiscard]] std::vector<Device> devices(const std::string& scanner, const Calibration& calibration);

/// A robot description (URDF, metres and radians) of a scanner: one link for each frame, with a box that marks the
/// device. The boxes are symbols; the joints come from the calibration.
/// @param devices  devices in the rig frame are its own; empty: not calibrated, so only the rig's frame exists
/// @param placed   extrinsics place it, so the rig's frame is the root; otherwise the body's is
/// @thread reentrant
[[nodiscard]] std::string robot_description(const std::string& scanner, const std::vector<Device>& devices,
                                            bool placed = false);

}  // namespace slsd::dds
