// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <slsd/cloud.hpp>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "ros.hpp"

namespace slsd::dds {

/// The key of the calibration date in a scanner's diagnostics.
inline constexpr const char* kCalibrationDate = "calibration date";

[[nodiscard]] ros::Time stamp_of(std::chrono::system_clock::time_point time);
[[nodiscard]] ros::Time stamp_now();

/// The bytes of one point: x y z sigma intensity (float32), camera scanner (uint8), two of padding.
inline constexpr std::uint32_t kPointStep = 24;
/// The same of a coloured point, and `rgb`: the number 0xRRGGBB in the bits of a float32, as PCL and RViz read it.
inline constexpr std::uint32_t kColouredPointStep = 28;
/// The fields of a point; only merged clouds have `scanner`, only coloured ones `rgb`.
enum class PointKind { kPlain, kMerged, kColoured };
[[nodiscard]] std::vector<ros::PointField> point_fields(PointKind kind);
/// Sets everything except the header: points of this kind in one array, unorganised.
void set_points(ros::PointCloud2& message, PointKind kind, std::vector<std::uint8_t> data);

/// Selects the points of a cloud for publication.
struct Thinning {
  int stride = 2;       ///< dense clouds: keeps every n-th pixel of every n-th row
  double voxel_mm = 0;  ///< keeps one point in each cube of this size; 0: all
};

/// Converts a cloud to metres. The axes of slsd's rig frame equal those of ROS's optical frames: x right, y down, z
/// forward.
/// A cloud with red, green and blue becomes one of kColoured.
/// @param cameras  of the calibration, in the frame of the cloud; a stride requires them
/// @param frame_from_cloud  moves the points into another frame
/// @thread reentrant
[[nodiscard]] ros::PointCloud2 point_cloud(const client::Cloud& cloud, const ros::Header& header,
                                           const std::vector<CalibratedCamera>& cameras, const Thinning& thinning,
                                           const RigidTransform& frame_from_cloud = {});

/// The depth (Z, metres) of a dense cloud in a camera's own picture with its lens distortion: "32FC1", NaN without a
/// measurement.
/// @param index   index of the camera in the cloud
/// @param stride  keeps every n-th pixel and row; the size in the camera info shows it
[[nodiscard]] ros::Image depth_image(const client::Cloud& cloud, const ros::Header& header,
                                     const CalibratedCamera& camera, std::uint8_t index, int stride);

/// The camera info of a calibrated camera: "plumb_bob", and P without rectification.
/// @param stride  of a picture with every n-th pixel and row of the camera's
[[nodiscard]] ros::CameraInfo camera_info(const CalibratedCamera& camera, const ros::Header& header, int stride = 1);

/// "mono8" or "mono16".
[[nodiscard]] ros::Image image(const client::Frame& frame, const ros::Header& header);
/// The image as JPEG with 8 bits. @errors kIo: the frame has no pixels
[[nodiscard]] Result<ros::CompressedImage> compressed_image(const client::Frame& frame, const ros::Header& header);

/// The transform from the child to its parent, converted from millimetres to ROS's metres and quaternion.
[[nodiscard]] ros::TransformStamped transform(const std::string& parent, const std::string& child,
                                              const RigidTransform& parent_from_child, ros::Time stamp);

}  // namespace slsd::dds
