// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/point_residuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/robust.hpp"

namespace slsd {

ViewResiduals residuals_of(const PoseView& view, const RigModel& rig, const MotionVector& rig_from_board,
                           PoseSubject subject) {
  const DeviceModel& camera = rig.cameras[view.camera];
  const Lens camera_lens = to_lens(camera.lens, camera.size), projector_lens = to_lens(rig.projector.lens, {});
  const RigidTransform camera_from_rig = to_motion(camera.device_from_rig),
                       projector_from_rig = to_motion(rig.projector.device_from_rig),
                       rig_from_plane = to_motion(rig_from_board);
  const Eigen::Vector2d missed = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  ViewResiduals out;
  for (const BoardPoint& corner : view.corners) {
    const Eigen::Vector3d on_board = rig.printed_mm(corner.board_mm, subject);
    out.corners_px.push_back(camera_lens.project(camera_from_rig * (rig_from_plane * on_board)) - corner.camera_px);
  }
  for (const ProjectedPoint& symbol : view.symbols) {
    const auto lit = rig.meet(rig.projector, rig_from_plane, symbol.projector_px, subject);
    const auto seen = rig.meet(camera, rig_from_plane, symbol.camera_px, subject);
    if (!lit || !seen) {
      out.symbols_px.push_back(missed), out.symbols_projector_px.push_back(missed);
      continue;
    }
    out.symbols_px.push_back(camera_lens.project(camera_from_rig * *lit) - symbol.camera_px);
    out.symbols_projector_px.push_back(projector_lens.project(projector_from_rig * *seen) - symbol.projector_px);
  }
  return out;
}

double rms_px(const std::vector<Eigen::Vector2d>& residuals) {
  double sum = 0;
  for (const Eigen::Vector2d& residual : residuals) sum += residual.squaredNorm();
  return residuals.empty() ? 0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

double robust_sigma_px(std::vector<double> components) {
  for (double& component : components) component = std::abs(component);
  return kSigmaOfMedian * median_of(std::move(components));
}

}  // namespace slsd
