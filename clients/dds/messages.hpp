// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <slsd/cloud.hpp>

#include "core/geometry/calibration.hpp"
#include "ros.hpp"

namespace slsd::dds {

/// The key of a scanner's diagnostics that tells when it was calibrated.
inline constexpr const char* kCalibrationDate = "calibration date";

/// The time that a description tells ("2026-01-31T12:00:00.250Z"); now if it tells none. @thread reentrant
[[nodiscard]] ros::Time stamp_of(std::string_view utc);
[[nodiscard]] ros::Time stamp_now();

/// The bytes of one of our points: x y z sigma intensity (float32), camera scanner (uint8), two of padding.
inline constexpr std::uint32_t kPointStep = 24;
/// The fields of a point; `scanner` is of merged clouds only.
[[nodiscard]] std::vector<ros::PointField> point_fields(bool merged);
/// Sets all but the header and the fields: points in one array, unorganised.
void set_points(ros::PointCloud2& message, std::vector<std::uint8_t> data);

/// The choice of a cloud's points that are published.
struct Thinning {
  int stride = 2;       ///< dense clouds: of every so many pixels of a row, and of every so many rows
  double voxel_mm = 0;  ///< one point to each cube of this size; 0: all
};

/// A cloud in metres. Its axes are those of slsd's rig frame, which are those of ROS's optical frames: x right, y down,
/// z forward.
/// @param cameras  of the calibration; a stride needs them
/// @thread reentrant
[[nodiscard]] ros::PointCloud2 point_cloud(const client::Cloud& cloud, const ros::Header& header,
                                           const std::vector<CalibratedCamera>& cameras, const Thinning& thinning);

/// The depth (Z, metres) of a dense cloud in a camera's own picture, lens distortion included: "32FC1", NaN where
/// nothing was measured.
/// @param index   of the camera in the cloud
/// @param stride  of every so many pixels and rows, as the camera info says by its size
[[nodiscard]] ros::Image depth_image(const client::Cloud& cloud, const ros::Header& header,
                                     const CalibratedCamera& camera, std::uint8_t index, int stride);

/// A camera as its calibration has it: "plumb_bob", and P without rectifying.
/// @param stride  of a picture that has every so many pixels and rows of the camera's
[[nodiscard]] ros::CameraInfo camera_info(const CalibratedCamera& camera, const ros::Header& header, int stride = 1);

/// "mono8" or "mono16".
[[nodiscard]] ros::Image image(const client::Frame& frame, const ros::Header& header);
/// The same as JPEG, of 8 bits. @errors kIo: the frame has no pixels
[[nodiscard]] Result<ros::CompressedImage> compressed_image(const client::Frame& frame, const ros::Header& header);

/// The transform of the child in the parent, from millimetres to ROS's metres and quaternion.
[[nodiscard]] ros::TransformStamped transform(const std::string& parent, const std::string& child,
                                              const RigidTransform& parent_from_child, ros::Time stamp);

}  // namespace slsd::dds
