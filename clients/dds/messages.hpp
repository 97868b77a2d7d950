// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <slsd/cloud.hpp>

#include "core/geometry/calibration.hpp"
#include "ros.h"

namespace slsd::dds {

/// By which of their values a scanner's diagnostics tell when it was calibrated.
inline constexpr const char* kCalibrationDate = "calibration date";

// ROS's messages as idlc's C structures. They point into what they are made of, which is to outlive them; nothing of
// them is to be freed.

/// The time that a description tells ("2026-01-31T12:00:00.250Z"); now where it tells none. @thread reentrant
[[nodiscard]] builtin_interfaces_msg_dds__Time_ stamp_of(std::string_view utc);
[[nodiscard]] builtin_interfaces_msg_dds__Time_ stamp_now();

/// sensor_msgs/PointField's types, and the bytes of a point of ours.
inline constexpr std::uint8_t kUint8 = 2, kFloat32 = 7;
inline constexpr std::uint32_t kPointStep = 20;
[[nodiscard]] sensor_msgs_msg_dds__PointField_ field(const char* name, std::uint32_t offset, std::uint8_t type);
/// The fields of points in one array, unorganised, into a message that has its header.
void set_points(sensor_msgs_msg_dds__PointCloud2_& message, sensor_msgs_msg_dds__PointField_* fields,
                std::uint32_t field_count, std::vector<std::uint8_t>& data);

/// A cloud in metres, as x y z sigma (float32), intensity and camera (uint8), 20 bytes a point. Its axes are those of
/// slsd's rig frame, which are those of ROS's optical frames: x right, y down, z forward.
/// @thread thread-bound
class CloudMessage {
 public:
  [[nodiscard]] const sensor_msgs_msg_dds__PointCloud2_& of(const client::Cloud& cloud, const std::string& frame_id,
                                                            builtin_interfaces_msg_dds__Time_ stamp);

 private:
  std::vector<std::uint8_t> data_;  ///< kept from cloud to cloud
  sensor_msgs_msg_dds__PointCloud2_ message_{};
};

/// A camera as its calibration has it: "plumb_bob", and P without rectifying.
[[nodiscard]] sensor_msgs_msg_dds__CameraInfo_ camera_info(const CalibratedCamera& camera, const std::string& frame_id,
                                                           builtin_interfaces_msg_dds__Time_ stamp);

/// "mono8" or "mono16".
[[nodiscard]] sensor_msgs_msg_dds__Image_ image(const client::Frame& frame, const std::string& frame_id,
                                                builtin_interfaces_msg_dds__Time_ stamp);

/// Where the child stands in the parent, in millimetres, as ROS has it: metres and a quaternion.
[[nodiscard]] geometry_msgs_msg_dds__TransformStamped_ transform(const std::string& parent, const std::string& child,
                                                                 const RigidTransform& parent_from_child,
                                                                 builtin_interfaces_msg_dds__Time_ stamp);

}  // namespace slsd::dds
