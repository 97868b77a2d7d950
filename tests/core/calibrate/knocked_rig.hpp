// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Geometry>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// The same rig, whose projector was turned about its own centre by a vector of angles, mrad.
inline RigModel knocked(RigModel rig, const Eigen::Vector3d& turn_mrad) {
  const Eigen::Vector3d turn = turn_mrad / 1000;
  const Eigen::Matrix3d more = turn.norm() > 0 ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                                               : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const RigidTransform before = to_motion(rig.projector.device_from_rig);
  rig.projector.device_from_rig = to_vector(RigidTransform{more * before.rotation, more * before.translation});
  return rig;
}

}  // namespace slsd
