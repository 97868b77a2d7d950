// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <map>
#include <optional>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/board_shape.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// A rigid motion as optimised: angle-axis (rad), then translation (mm).
using MotionVector = std::array<double, 6>;
/// fx fy cx cy (px) k1 k2 p1 p2 k3: in the order of a calibration file.
using LensVector = std::array<double, 9>;

[[nodiscard]] MotionVector to_vector(const RigidTransform& motion);
[[nodiscard]] RigidTransform to_motion(const MotionVector& vector);
[[nodiscard]] LensVector to_vector(const Lens& lens);
[[nodiscard]] Lens to_lens(const LensVector& vector, const ImageSize& size);

/// A camera, or the projector as an inverse camera.
struct DeviceModel {
  ImageSize size;
  LensVector lens{};
  MotionVector device_from_rig{};
};

/// Places of the devices from a pose on, for the test whether a session is one rig.
struct MovedDevices {
  std::size_t first_pose = 0;
  std::vector<MotionVector> cameras;  ///< the first one, which defines the rig's frame, is ignored
  MotionVector projector{};
};

/// Everything that is adjusted: the devices and the poses of the board and the reference plane. The rig's frame is that
/// of the first camera.
struct RigModel {
  std::vector<DeviceModel> cameras;
  DeviceModel projector;
  std::vector<MotionVector> rig_from_board;  ///< one for each pose
  double board_stretch = 0;                  ///< excess of the print's length along y over that along x
  double board_scale = 0;                    ///< excess of the board's print over its stated size, relative to the
                                             ///< reference plane
  BoardShape shape;                          ///< the board's shape; the reference plane counts as flat
  std::optional<MovedDevices> moved;         ///< empty: the session is one rig
  std::map<std::size_t, MotionVector>
      rig_from_lit;  ///< place of the symbols, for poses whose symbols lie on a plane of their own

  /// Place of a point on the print; on the board's, with its scale, stretch and shape.
  /// @param nominal_mm  its nominal place
  [[nodiscard]] Eigen::Vector3d printed_mm(const Eigen::Vector2d& nominal_mm, PoseSubject subject) const;
  /// Point at which a device's pixel meets the subject, mm in the rig's frame; empty if it misses.
  [[nodiscard]] std::optional<Eigen::Vector3d> meet(const DeviceModel& device, const RigidTransform& rig_from_subject,
                                                    const Eigen::Vector2d& pixel, PoseSubject subject) const;
  /// The rig as it was at a pose.
  [[nodiscard]] RigModel as_of(std::size_t pose) const;
  [[nodiscard]] Calibration calibration(const std::vector<NamedCamera>& names) const;
};

}  // namespace slsd
