// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "messages.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iterator>

#include <Eigen/Geometry>

#include "core/utc_text.hpp"

namespace slsd::dds {
namespace {

// idlc's C strings are not const; nobody writes to them.
char* text(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

builtin_interfaces_msg_dds__Time_ stamp(std::chrono::system_clock::time_point time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  return {static_cast<std::int32_t>(seconds.time_since_epoch().count()),
          static_cast<std::uint32_t>(std::chrono::nanoseconds(time - seconds).count())};
}

}  // namespace

sensor_msgs_msg_dds__PointField_ field(const char* name, std::uint32_t offset, std::uint8_t type) {
  return {const_cast<char*>(name), offset, type, 1};
}

void set_points(sensor_msgs_msg_dds__PointCloud2_& message, sensor_msgs_msg_dds__PointField_* fields,
                std::uint32_t field_count, std::vector<std::uint8_t>& data) {
  message.height = 1;
  message.width = static_cast<std::uint32_t>(data.size() / kPointStep);
  message.fields = {field_count, field_count, fields, false};
  message.is_bigendian = false;
  message.point_step = kPointStep;
  message.row_step = static_cast<std::uint32_t>(data.size());
  message.data = {message.row_step, message.row_step, data.data(), false};
  message.is_dense = true;
}

builtin_interfaces_msg_dds__Time_ stamp_now() {
  return stamp(std::chrono::system_clock::now());
}

builtin_interfaces_msg_dds__Time_ stamp_of(std::string_view utc) {
  const auto time = time_from_utc(utc);
  return time ? stamp(*time) : stamp_now();
}

const sensor_msgs_msg_dds__PointCloud2_& CloudMessage::of(const client::Cloud& cloud, const std::string& frame_id,
                                                          builtin_interfaces_msg_dds__Time_ stamp) {
  static sensor_msgs_msg_dds__PointField_ fields[] = {field("x", 0, kFloat32),        field("y", 4, kFloat32),
                                                      field("z", 8, kFloat32),        field("sigma", 12, kFloat32),
                                                      field("intensity", 16, kUint8), field("camera", 17, kUint8)};
  data_.resize(kPointStep * cloud.size());
  std::uint8_t* to = data_.data();
  for (const client::Point point : cloud) {
    const float metres[] = {point.x / 1000, point.y / 1000, point.z / 1000, point.sigma_mm / 1000};
    std::memcpy(to, metres, sizeof metres);
    to[16] = point.intensity;
    to[17] = point.camera;
    to[18] = to[19] = 0;
    to += kPointStep;
  }
  message_.header = {stamp, text(frame_id)};
  set_points(message_, fields, std::size(fields), data_);
  return message_;
}

sensor_msgs_msg_dds__CameraInfo_ camera_info(const CalibratedCamera& camera, const std::string& frame_id,
                                             builtin_interfaces_msg_dds__Time_ stamp) {
  static std::string model = "plumb_bob";
  const Lens& lens = camera.lens;
  sensor_msgs_msg_dds__CameraInfo_ info{};
  info.header = {stamp, text(frame_id)};
  info.height = static_cast<std::uint32_t>(lens.height_px);
  info.width = static_cast<std::uint32_t>(lens.width_px);
  info.distortion_model = model.data();
  info.d = {5, 5, const_cast<double*>(lens.distortion.data()), false};
  const double k[] = {lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1};
  const double r[] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const double p[] = {lens.fx, 0, lens.cx, 0, 0, lens.fy, lens.cy, 0, 0, 0, 1, 0};
  std::copy(std::begin(k), std::end(k), info.k);
  std::copy(std::begin(r), std::end(r), info.r);
  std::copy(std::begin(p), std::end(p), info.p);
  return info;
}

sensor_msgs_msg_dds__Image_ image(const client::Frame& frame, const std::string& frame_id,
                                  builtin_interfaces_msg_dds__Time_ stamp) {
  static std::string mono8 = "mono8", mono16 = "mono16";
  const auto size = static_cast<std::uint32_t>(frame.pixels.size());
  sensor_msgs_msg_dds__Image_ image{};
  image.header = {stamp, text(frame_id)};
  image.height = static_cast<std::uint32_t>(frame.height_px);
  image.width = static_cast<std::uint32_t>(frame.width_px);
  image.encoding = frame.bits > 8 ? mono16.data() : mono8.data();
  image.step = image.width * (frame.bits > 8 ? 2U : 1U);
  image.data = {size, size, reinterpret_cast<std::uint8_t*>(const_cast<char*>(frame.pixels.data())), false};
  return image;
}

geometry_msgs_msg_dds__TransformStamped_ transform(const std::string& parent, const std::string& child,
                                                   const RigidTransform& parent_from_child,
                                                   builtin_interfaces_msg_dds__Time_ stamp) {
  const Eigen::Quaterniond turn(parent_from_child.rotation);
  const Eigen::Vector3d& at = parent_from_child.translation;
  return {{stamp, text(parent)},
          text(child),
          {{at.x() / 1000, at.y() / 1000, at.z() / 1000}, {turn.x(), turn.y(), turn.z(), turn.w()}}};
}

}  // namespace slsd::dds
