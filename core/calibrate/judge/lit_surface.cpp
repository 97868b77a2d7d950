// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/lit_surface.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/QR>

#include "core/geometry/robust.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

/// Removes the board's shape from a point: all poses share it, so it is no fault of one.
Eigen::Vector3d off_shape(const Eigen::Vector3d& point, PoseSubject subject, const RigModel& rig) {
  const double height_mm = subject == PoseSubject::kBoard ? rig.shape.height_mm(point.head<2>()) : 0;
  return point - height_mm * Eigen::Vector3d::UnitZ();
}

std::vector<Eigen::Vector3d> points_on_board(const PoseObservation& pose, const RigModel& rig,
                                             const MotionVector& rig_from_board) {
  const RigidTransform board_from_rig = to_motion(rig_from_board).inverse();
  const RigidTransform projector_from_rig = to_motion(rig.projector.device_from_rig);
  const Lens projector = to_lens(rig.projector.lens, rig.projector.size);
  std::vector<Eigen::Vector3d> points;
  for (const PoseView& view : pose.views) {
    const DeviceModel& device = rig.cameras[view.camera];
    const RigidTransform rig_from_camera = to_motion(device.device_from_rig).inverse();
    const CalibratedCamera camera{"", to_lens(device.lens, device.size), projector_from_rig.after(rig_from_camera), {}};
    for (const ProjectedPoint& symbol : view.symbols) {
      const auto solved = triangulate({symbol.camera_px, symbol.projector_px}, camera, projector, 1);
      if (solved.point_in_camera.allFinite())
        points.push_back(off_shape(board_from_rig * (rig_from_camera * solved.point_in_camera), pose.subject, rig));
    }
  }
  return points;
}

/// Share of half the board's size by which a symbol may lie before the plane and still be on the board.
constexpr double kBeforeShare = 0.03;

/// z over terms in x and y, both of about one; misread symbols, which lie anywhere, get no weight.
struct SurfaceFit {
  Eigen::VectorXd coefficients;
  Eigen::VectorXd weights;  // 0 to 1
};

SurfaceFit fit(const Eigen::MatrixXd& terms, const Eigen::VectorXd& z) {
  constexpr int kFitRounds = 8;
  SurfaceFit found{Eigen::VectorXd::Zero(terms.cols()), {}};
  found.coefficients(0) = median_of(std::vector<double>(z.begin(), z.end()));
  for (int round = 0; round < kFitRounds; ++round) {
    const Eigen::VectorXd off = (z - terms * found.coefficients).cwiseAbs();
    const double scale = 4 * std::max(median_of(std::vector<double>(off.begin(), off.end())), 1e-9);
    found.weights = off.unaryExpr([&](double each) { return robust_weight(each, scale); });
    const Eigen::VectorXd root = found.weights.cwiseSqrt();
    found.coefficients = (root.asDiagonal() * terms).colPivHouseholderQr().solve(root.cwiseProduct(z));
  }
  return found;
}

double mean_square(const Eigen::VectorXd& values, const Eigen::VectorXd& weights) {
  return weights.dot(values.cwiseAbs2()) / weights.sum();
}

}  // namespace

double LitSurface::shift_mm(double half_size_mm) const {
  return std::abs(offset_mm) + half_size_mm * std::abs(tilt_deg) * std::numbers::pi / 180;
}

LitSurface measure_lit_surface(const PoseObservation& pose, const RigModel& rig, const MotionVector& rig_from_board) {
  constexpr std::size_t kPointsMin = 12;
  const std::vector<Eigen::Vector3d> points = points_on_board(pose, rig, rig_from_board);
  if (points.size() < kPointsMin) return {};
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) middle += point / static_cast<double>(points.size());
  const double scale = std::max(half_size_mm(pose), 1.0);
  const auto rows = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd terms(rows, 6);
  Eigen::VectorXd z(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Vector3d& p = points[static_cast<std::size_t>(i)];
    const double x = (p.x() - middle.x()) / scale, y = (p.y() - middle.y()) / scale;
    terms.row(i) << 1, x, y, x * x, x * y, y * y;
    z(i) = p.z();
  }
  const SurfaceFit bend = fit(terms, z);
  const Eigen::VectorXd smooth = terms * bend.coefficients;
  const Eigen::VectorXd plane = terms.leftCols(3).colPivHouseholderQr().solve(smooth);
  const Eigen::VectorXd bowed = smooth - terms.leftCols(3) * plane;
  const double off = mean_square(z - terms.leftCols(3) * plane, bend.weights);
  LitSurface surface;
  surface.offset_mm = plane(0);
  surface.tilt_deg = std::atan(plane.tail(2).norm() / scale) * 180 / std::numbers::pi;
  surface.bow_mm = bowed.maxCoeff() - bowed.minCoeff();
  surface.bow_share = off > 0 ? 1 - mean_square(z - smooth, bend.weights) / off : 0;
  surface.flatness_mm = std::sqrt(off);
  const double before = kBeforeShare * scale;
  std::vector<double> in_front;
  std::size_t behind = 0;
  for (const double height : z) {
    if (height < -before) in_front.push_back(-height);
    behind += height > before ? 1 : 0;
  }
  if (in_front.size() > behind) {
    surface.before_share = static_cast<double>(in_front.size() - behind) / static_cast<double>(rows);
    surface.before_mm = median_of(std::move(in_front));
  }
  return surface;
}

double half_size_mm(const PoseObservation& pose) {
  Eigen::AlignedBox2d box;
  for (const PoseView& view : pose.views) {
    for (const BoardPoint& corner : view.corners) box.extend(corner.board_mm);
  }
  return box.isEmpty() ? 0 : 0.5 * box.diagonal().norm();
}

}  // namespace slsd
