// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/depth_uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

constexpr int kAcross = 8, kDown = 6;

double* value_in(RigModel& rig, const SharedParameter& parameter) {
  DeviceModel& device = parameter.device < 0 ? rig.projector : rig.cameras[static_cast<std::size_t>(parameter.device)];
  const auto index = static_cast<std::size_t>(parameter.index);
  switch (parameter.kind) {
    case SharedParameter::Kind::kLens:
      return &device.lens[index];
    case SharedParameter::Kind::kMotion:
    case SharedParameter::Kind::kMovedTo:
      return &device.device_from_rig[index];
    case SharedParameter::Kind::kShape:
      return &rig.shape.terms_mm[index];
    case SharedParameter::Kind::kScale:
      return &rig.board_scale;
    case SharedParameter::Kind::kStretch:
      break;
  }
  return &rig.board_stretch;
}

/// A step of a parameter over which the depth is practically linear.
double step_of(const SharedParameter& parameter) {
  if (parameter.kind == SharedParameter::Kind::kLens) return parameter.index < 4 ? 1e-2 : 1e-6;
  return parameter.index < 3 ? 1e-6 : 1e-2;
}

CalibratedCamera first_camera(const RigModel& rig) {
  return {"", to_lens(rig.cameras[0].lens, rig.cameras[0].size), to_motion(rig.projector.device_from_rig), {}};
}

TriangulatedPoint depth_of(const Match& match, const RigModel& rig, double sigma_px) {
  return triangulate(match, first_camera(rig), to_lens(rig.projector.lens, rig.projector.size), sigma_px);
}

std::vector<Match> matches_at(double depth_mm, const RigModel& rig) {
  const CalibratedCamera camera = first_camera(rig);
  const Lens projector = to_lens(rig.projector.lens, rig.projector.size);
  std::vector<Match> matches;
  for (int row = 0; row < kDown; ++row) {
    for (int column = 0; column < kAcross; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) / kAcross * camera.lens.width_px - 0.5,
                                  (row + 0.5) / kDown * camera.lens.height_px - 0.5);
      const Eigen::Vector3d point = depth_mm * camera.lens.undistort(pixel).homogeneous();
      const Eigen::Vector3d in_projector = camera.projector_from_camera * point;
      if (in_projector.z() <= 0) continue;
      const Eigen::Vector2d lit = projector.project(in_projector);
      if (lit.x() >= 0 && lit.y() >= 0 && lit.x() < projector.width_px && lit.y() < projector.height_px)
        matches.push_back({pixel, lit});
    }
  }
  return matches;
}

}  // namespace

std::vector<DepthUncertainty> depth_uncertainty(const RigModel& rig, const std::vector<SharedParameter>& shared,
                                                const PoseInfluence& influence, double symbol_sigma_px,
                                                const std::vector<double>& depths_mm) {
  std::vector<DepthUncertainty> out;
  for (const double depth_mm : depths_mm) {
    const std::vector<Match> matches = matches_at(depth_mm, rig);
    if (matches.empty()) continue;
    double calibration = 0, noise = 0;
    for (const Match& match : matches) {
      const TriangulatedPoint point = depth_of(match, rig, symbol_sigma_px);
      Eigen::VectorXd slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(shared.size()));
      for (std::size_t i = 0; i < shared.size(); ++i) {
        if (shared[i].kind == SharedParameter::Kind::kShape) continue;  // it does not affect depth directly
        RigModel changed = rig;
        *value_in(changed, shared[i]) += step_of(shared[i]);
        const double moved = depth_of(match, changed, symbol_sigma_px).point_in_camera.z();
        slope(static_cast<Eigen::Index>(i)) = (moved - point.point_in_camera.z()) / step_of(shared[i]);
      }
      calibration += slope.dot(influence.covariance * slope);
      noise += point.sigma_mm * point.sigma_mm;
    }
    const auto count = static_cast<double>(matches.size());
    out.push_back({depth_mm, std::sqrt(calibration / count), std::sqrt(noise / count)});
  }
  return out;
}

}  // namespace slsd
