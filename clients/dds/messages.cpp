// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <unordered_set>
#include <utility>

#include <Eigen/Geometry>

#include "core/cloud/cube_grid.hpp"

namespace slsd::dds {
namespace {

/// The camera pixel of a dense point.
struct Pixel {
  int u = 0, v = 0;
};

Pixel pixel_of(const client::Point& point, const CalibratedCamera& camera) {
  const Eigen::Vector3d at = camera.rig_from_camera.inverse() * Eigen::Vector3d(point.x, point.y, point.z);
  const Eigen::Vector2d pixel = camera.lens.project(at);
  return {static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))};
}

/// Keeps the first point in each cube.
class VoxelGrid {
 public:
  explicit VoxelGrid(double side_mm) : grid_(side_mm) {}
  bool take(const client::Point& point) {
    return taken_.insert(grid_.at(Eigen::Vector3f(point.x, point.y, point.z).cast<double>())).second;
  }

 private:
  CubeGrid grid_;
  std::unordered_set<Cube, CubeHash> taken_;
};

bool on_stride(const client::Point& point, const std::vector<CalibratedCamera>& cameras, int stride) {
  if (stride <= 1 || point.camera >= cameras.size()) return true;
  const Pixel pixel = pixel_of(point, cameras[point.camera]);
  return pixel.u % stride == 0 && pixel.v % stride == 0;
}

std::uint32_t step_of(PointKind kind) {
  return kind == PointKind::kColoured ? kColouredPointStep : kPointStep;
}

/// The colours of a cloud's points, packed as in the field `rgb`.
class Colours {
 public:
  explicit Colours(const client::Cloud& cloud)
      : red_(cloud.column<std::uint8_t>("red")),
        green_(cloud.column<std::uint8_t>("green")),
        blue_(cloud.column<std::uint8_t>("blue")) {}
  [[nodiscard]] std::uint32_t packed(std::size_t i) const {
    return std::uint32_t{red_[i]} << 16U | std::uint32_t{green_[i]} << 8U | blue_[i];
  }

 private:
  client::Column<std::uint8_t> red_, green_, blue_;
};

}  // namespace

std::vector<ros::PointField> point_fields(PointKind kind) {
  using Kind = ros::PointField;
  std::vector<ros::PointField> fields{{"x", 0, Kind::kFloat32},          {"y", 4, Kind::kFloat32},
                                      {"z", 8, Kind::kFloat32},          {"sigma", 12, Kind::kFloat32},
                                      {"intensity", 16, Kind::kFloat32}, {"camera", 20, Kind::kUint8}};
  if (kind == PointKind::kMerged) fields.push_back({"scanner", 21, Kind::kUint8});
  if (kind == PointKind::kColoured) fields.push_back({"rgb", 24, Kind::kFloat32});
  return fields;
}

void set_points(ros::PointCloud2& message, PointKind kind, std::vector<std::uint8_t> data) {
  message.point_fields = point_fields(kind);
  message.height = 1;
  message.point_step = step_of(kind);
  message.width = static_cast<std::uint32_t>(data.size() / message.point_step);
  message.row_step = static_cast<std::uint32_t>(data.size());
  message.data = std::move(data);
  message.is_dense = true;
}

ros::Time stamp_now() {
  return stamp_of(std::chrono::system_clock::now());
}

ros::Time stamp_of(std::chrono::system_clock::time_point time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  return {static_cast<std::int32_t>(seconds.time_since_epoch().count()),
          static_cast<std::uint32_t>(std::chrono::nanoseconds(time - seconds).count())};
}

ros::PointCloud2 point_cloud(const client::Cloud& cloud, const ros::Header& header,
                             const std::vector<CalibratedCamera>& cameras, const Thinning& thinning,
                             const RigidTransform& frame_from_cloud) {
  const bool dense = !cloud.has("camera_u");
  const int stride = dense ? thinning.stride : 1;
  std::optional<VoxelGrid> voxels;
  if (thinning.voxel_mm > 0) voxels.emplace(thinning.voxel_mm);
  const bool moves = !frame_from_cloud.rotation.isIdentity(0) ||
                     !frame_from_cloud.translation.isZero(0);  // else bits stay as they are
  const auto colours = cloud.has("red") ? std::optional<Colours>(cloud) : std::nullopt;
  const PointKind kind = colours ? PointKind::kColoured : PointKind::kPlain;
  std::vector<std::uint8_t> data(step_of(kind) * cloud.size());
  std::uint8_t* to = data.data();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const client::Point point = cloud[i];
    if (!on_stride(point, cameras, stride) || (voxels && !voxels->take(point))) continue;
    Eigen::Vector3f at(point.x, point.y, point.z);
    if (moves) at = (frame_from_cloud * at.cast<double>()).cast<float>();
    const float values[] = {at.x() / 1000, at.y() / 1000, at.z() / 1000, point.sigma_mm / 1000,
                            static_cast<float>(point.intensity)};
    std::memcpy(to, values, sizeof values);
    to[20] = point.camera;
    if (colours) {
      const std::uint32_t packed = colours->packed(i);
      std::memcpy(to + kPointStep, &packed, sizeof packed);
    }
    to += step_of(kind);
  }
  data.resize(static_cast<std::size_t>(to - data.data()));
  ros::PointCloud2 message;
  message.header = header;
  set_points(message, kind, std::move(data));
  return message;
}

ros::Image depth_image(const client::Cloud& cloud, const ros::Header& header, const CalibratedCamera& camera,
                       std::uint8_t index, int stride) {
  ros::Image image;
  image.header = header;
  image.width = static_cast<std::uint32_t>((camera.lens.width_px + stride - 1) / stride);
  image.height = static_cast<std::uint32_t>((camera.lens.height_px + stride - 1) / stride);
  image.encoding = "32FC1";
  image.step = image.width * 4;
  std::vector<float> depth(std::size_t{image.width} * image.height, std::numeric_limits<float>::quiet_NaN());
  for (const client::Point point : cloud) {
    if (point.camera != index) continue;
    const Pixel pixel = pixel_of(point, camera);
    if (pixel.u % stride != 0 || pixel.v % stride != 0 || pixel.u < 0 || pixel.v < 0 ||
        pixel.u >= camera.lens.width_px || pixel.v >= camera.lens.height_px) {
      continue;
    }
    const Eigen::Vector3d at = camera.rig_from_camera.inverse() * Eigen::Vector3d(point.x, point.y, point.z);
    depth[static_cast<std::size_t>(pixel.v / stride) * image.width + static_cast<std::size_t>(pixel.u / stride)] =
        static_cast<float>(at.z() / 1000);
  }
  image.data.resize(depth.size() * sizeof(float));
  std::memcpy(image.data.data(), depth.data(), image.data.size());
  return image;
}

ros::CameraInfo camera_info(const CalibratedCamera& camera, const ros::Header& header, int stride) {
  const Lens& lens = camera.lens;
  // Both have the same first pixel, and pixel centres have integer coordinates.
  const double fx = lens.fx / stride, fy = lens.fy / stride, cx = lens.cx / stride, cy = lens.cy / stride;
  ros::CameraInfo info;
  info.header = header;
  info.height = static_cast<std::uint32_t>((lens.height_px + stride - 1) / stride);
  info.width = static_cast<std::uint32_t>((lens.width_px + stride - 1) / stride);
  info.distortion_model = "plumb_bob";
  info.d.assign(lens.distortion.begin(), lens.distortion.end());
  info.k = {fx, 0, cx, 0, fy, cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0};
  return info;
}

ros::Image image(const client::Frame& frame, const ros::Header& header) {
  ros::Image image;
  image.header = header;
  image.height = static_cast<std::uint32_t>(frame.height_px);
  image.width = static_cast<std::uint32_t>(frame.width_px);
  image.encoding = frame.bits > 8 ? "mono16" : "mono8";
  image.step = image.width * (frame.bits > 8 ? 2U : 1U);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(frame.pixels.data());
  image.data.assign(begin, begin + frame.pixels.size());
  return image;
}

ros::TransformStamped transform(const std::string& parent, const std::string& child,
                                const RigidTransform& parent_from_child, ros::Time stamp) {
  const Eigen::Quaterniond turn(parent_from_child.rotation);
  const Eigen::Vector3d& at = parent_from_child.translation;
  return {
      {stamp, parent}, child, {at.x() / 1000, at.y() / 1000, at.z() / 1000}, {turn.x(), turn.y(), turn.z(), turn.w()}};
}

}  // namespace slsd::dds
