// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "description.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "endpoints.hpp"

namespace slsd::dds {
namespace {

// Behind the lens centre, which is the frame's origin.
struct Box {
  double width_m, height_m, depth_m;
  const char* colour;
};
constexpr Box kCamera{0.03, 0.03, 0.04, "0.2 0.2 0.25 1"};
constexpr Box kProjector{0.12, 0.06, 0.10, "0.85 0.85 0.85 1"};
constexpr const char* kProjectorPart = "projector";

// Rotations about the fixed axes x, y and z in sequence. At a vertical pitch, roll and yaw are known only together: the
// yaw is extracted first, so that their sum holds.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  const double yaw = std::atan2(r(1, 0), r(0, 0));
  const double c = std::cos(yaw), s = std::sin(yaw);
  const double pitch = std::atan2(-r(2, 0), c * r(0, 0) + s * r(1, 0));
  return {std::atan2(s * r(0, 2) - c * r(1, 2), c * r(1, 1) - s * r(0, 1)), pitch, yaw};
}

std::string numbers(const Eigen::Vector3d& v) {
  const Eigen::Vector3d plain = v + Eigen::Vector3d::Zero();  // avoids -0
  return fmt::format("{} {} {}", plain.x(), plain.y(), plain.z());
}

std::string link(const std::string& frame, const Box* box) {
  if (!box) return fmt::format("  <link name=\"{}\"/>\n", frame);
  return fmt::format(
      "  <link name=\"{0}\">\n"
      "    <visual>\n"
      "      <origin xyz=\"0 0 {1}\" rpy=\"0 0 0\"/>\n"
      "      <geometry><box size=\"{2} {3} {4}\"/></geometry>\n"
      "      <material name=\"{0}_colour\"><color rgba=\"{5}\"/></material>\n"
      "    </visual>\n"
      "  </link>\n",
      frame, -box->depth_m / 2, box->width_m, box->height_m, box->depth_m, box->colour);
}

std::string joint(const std::string& parent, const std::string& child, const RigidTransform& parent_from_child) {
  return fmt::format(
      "  <joint name=\"{0}_joint\" type=\"fixed\">\n"
      "    <parent link=\"{1}\"/>\n"
      "    <child link=\"{0}\"/>\n"
      "    <origin xyz=\"{2}\" rpy=\"{3}\"/>\n"
      "  </joint>\n",
      child, parent, numbers(parent_from_child.translation / 1000),
      numbers(roll_pitch_yaw(parent_from_child.rotation)));
}

const Box& box_of(const Device& device) {
  return device.kind == Device::Kind::kCamera ? kCamera : kProjector;
}

}  // namespace

std::string ros_name(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_ros_name(std::string("a") + c); }, '_');
  return is_ros_name(name) ? name : "camera_" + name;
}

std::string rig_frame(const std::string& scanner) {
  return scanner + "_optical_frame";
}
std::string camera_frame(const std::string& scanner, const std::string& camera) {
  const std::string part = ros_name(camera);
  return scanner + "_" + (part == kProjectorPart ? "camera_" : "") + part + "_optical_frame";
}
std::string body_frame(const std::string& scanner) {
  return scanner + "_link";
}

RigidTransform body_from_rig() {
  RigidTransform turn;
  turn.rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return turn;
}

Device projector(const std::string& scanner, const Calibration& calibration) {
  const CalibratedCamera& first = calibration.cameras.front();
  return {Device::Kind::kProjector, scanner + "_" + kProjectorPart + "_optical_frame",
          first.rig_from_camera.after(first.projector_from_camera.inverse())};
}

std::vector<Device> devices(const std::string& scanner, const Calibration& calibration) {
  std::vector<Device> all;
  for (const CalibratedCamera& camera : calibration.cameras) {
    const std::string frame = all.empty() ? rig_frame(scanner) : camera_frame(scanner, camera.name);
    all.push_back({Device::Kind::kCamera, frame, camera.rig_from_camera});
  }
  all.push_back(projector(scanner, calibration));
  return all;
}

std::string robot_description(const std::string& scanner, const std::vector<Device>& devices, bool placed) {
  const std::string rig = rig_frame(scanner);
  const auto own = std::find_if(devices.begin(), devices.end(), [&](const Device& one) { return one.frame_id == rig; });
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<!-- The joints are those of {}. The boxes are symbols, not the sizes of the devices. -->\n"
      "<robot name=\"{}\">\n",
      devices.empty() ? "an uncalibrated scanner, whose projector has no known pose" : "the scanner's calibration",
      scanner);
  if (!placed) {
    text += link(body_frame(scanner), nullptr);
    text += joint(body_frame(scanner), rig, body_from_rig());
  }
  text += link(rig, own != devices.end() ? &box_of(*own) : nullptr);
  for (const Device& device : devices) {
    if (device.frame_id == rig) continue;
    text += link(device.frame_id, &box_of(device));
    text += joint(rig, device.frame_id, device.rig_from_device);
  }
  return text + "</robot>\n";
}

}  // namespace slsd::dds
