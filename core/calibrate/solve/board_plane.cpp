// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/board_plane.hpp"

#include <Eigen/Geometry>

namespace slsd {

Eigen::Vector3d meet_board(const DeviceModel& device, const RigidTransform& rig_from_board,
                           const Eigen::Vector2d& pixel) {
  const RigidTransform rig_from_device = to_motion(device.device_from_rig).inverse();
  const Eigen::Vector3d ray =
      rig_from_device.rotation * to_lens(device.lens, device.size).undistort(pixel).homogeneous();
  const Eigen::Vector3d& eye = rig_from_device.translation;
  const Eigen::Vector3d normal = rig_from_board.rotation.col(2);
  return eye + normal.dot(rig_from_board.translation - eye) / normal.dot(ray) * ray;
}

}  // namespace slsd
