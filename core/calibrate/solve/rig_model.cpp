// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/rig_model.hpp"

#include <Eigen/Geometry>

namespace slsd {

MotionVector to_vector(const RigidTransform& motion) {
  const Eigen::AngleAxisd turn(motion.rotation);
  const Eigen::Vector3d r = turn.angle() * turn.axis();
  const Eigen::Vector3d& t = motion.translation;
  return {r.x(), r.y(), r.z(), t.x(), t.y(), t.z()};
}

RigidTransform to_motion(const MotionVector& v) {
  const Eigen::Vector3d r(v[0], v[1], v[2]);
  const double angle = r.norm();
  RigidTransform motion;
  if (angle > 0) motion.rotation = Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
  motion.translation = {v[3], v[4], v[5]};
  return motion;
}

LensVector to_vector(const Lens& lens) {
  const auto& [k1, k2, p1, p2, k3] = lens.distortion;
  return {lens.fx, lens.fy, lens.cx, lens.cy, k1, k2, p1, p2, k3};
}

Lens to_lens(const LensVector& v, const ImageSize& size) {
  return {size.width_px, size.height_px, v[0], v[1], v[2], v[3], {v[4], v[5], v[6], v[7], v[8]}};
}

Eigen::Vector3d RigModel::printed_mm(const Eigen::Vector2d& nominal_mm, PoseSubject subject) const {
  if (subject == PoseSubject::kPlane) return {nominal_mm.x(), nominal_mm.y(), 0};
  const double scale = 1 + board_scale;
  const Eigen::Vector2d printed(scale * nominal_mm.x(), scale * (1 + board_stretch) * nominal_mm.y());
  return {printed.x(), printed.y(), shape.height_mm(printed)};
}

std::optional<Eigen::Vector3d> RigModel::meet(const DeviceModel& device, const RigidTransform& rig_from_subject,
                                              const Eigen::Vector2d& pixel, PoseSubject subject) const {
  const RigidTransform board_from_device =
      rig_from_subject.inverse().after(to_motion(device.device_from_rig).inverse());
  const Eigen::Vector3d ray =
      board_from_device.rotation * to_lens(device.lens, device.size).undistort(pixel).homogeneous();
  const ShapeVector terms_mm = subject == PoseSubject::kBoard ? shape.terms_mm : ShapeVector{};
  const auto on_board = meet_shape(terms_mm.data(), shape.frame, board_from_device.translation, ray);
  if (!on_board) return std::nullopt;
  return rig_from_subject * *on_board;
}

RigModel RigModel::as_of(std::size_t pose) const {
  RigModel then = *this;
  then.moved.reset();
  if (!moved || pose < moved->first_pose) return then;
  then.projector.device_from_rig = moved->projector;
  for (std::size_t i = 1; i < cameras.size(); ++i) then.cameras[i].device_from_rig = moved->cameras[i];
  return then;
}

Calibration RigModel::calibration(const std::vector<NamedCamera>& names) const {
  Calibration result;
  result.projector = to_lens(projector.lens, projector.size);
  const RigidTransform projector_from_rig = to_motion(projector.device_from_rig);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CalibratedCamera& camera = result.cameras.emplace_back();
    camera.name = names[i].name;
    camera.lens = to_lens(cameras[i].lens, cameras[i].size);
    if (i > 0) camera.rig_from_camera = to_motion(cameras[i].device_from_rig).inverse();
    camera.projector_from_camera = projector_from_rig.after(camera.rig_from_camera);
  }
  return result;
}

}  // namespace slsd
