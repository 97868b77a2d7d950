// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/start/resection.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

using Projection = Eigen::Matrix<double, 3, 4>;
using Normal = Eigen::Matrix<double, 12, 12>;

constexpr std::size_t kPointsMin = 24;
constexpr int kRounds = 8;
/// Smallest accepted ratio of the second smallest to the largest eigenvalue: below it more than one solution fits.
constexpr double kRankTolerance = 1e-12;

/// Coordinates with their mean at the origin and a spread of one.
struct Scaling {
  Eigen::Vector3d point_middle = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel_middle = Eigen::Vector2d::Zero();
  double point_scale = 0, pixel_scale = 0;

  explicit Scaling(std::span<const SpacePoint> points) {
    const double count = static_cast<double>(points.size());
    for (const SpacePoint& p : points) point_middle += p.point_mm / count, pixel_middle += p.pixel / count;
    for (const SpacePoint& p : points) {
      point_scale += (p.point_mm - point_middle).norm() / count;
      pixel_scale += (p.pixel - pixel_middle).norm() / count;
    }
  }
  [[nodiscard]] Eigen::Vector4d point(const SpacePoint& p) const {
    return ((p.point_mm - point_middle) / point_scale).homogeneous();
  }
  [[nodiscard]] Eigen::Vector2d pixel(const SpacePoint& p) const { return (p.pixel - pixel_middle) / pixel_scale; }
  [[nodiscard]] Projection undo(const Projection& scaled) const {
    Eigen::Matrix3d pixels;
    pixels << pixel_scale, 0, pixel_middle.x(), 0, pixel_scale, pixel_middle.y(), 0, 0, 1;
    Eigen::Matrix4d space = Eigen::Matrix4d::Identity();
    space.topLeftCorner<3, 3>() /= point_scale;
    space.topRightCorner<3, 1>() = -point_middle / point_scale;
    return pixels * scaled * space;
  }
};

Normal normal_equations(std::span<const SpacePoint> points, const Scaling& scaling,
                        const std::vector<double>& weights) {
  Normal normal = Normal::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::RowVector4d p = scaling.point(points[i]).transpose();
    const Eigen::Vector2d q = scaling.pixel(points[i]);
    Eigen::Matrix<double, 2, 12> rows;
    rows << p, Eigen::RowVector4d::Zero(), -q.x() * p, Eigen::RowVector4d::Zero(), p, -q.y() * p;
    normal += weights[i] * rows.transpose() * rows;
  }
  return normal;
}

std::vector<double> weigh(std::span<const SpacePoint> points, const Scaling& scaling, const Projection& projection) {
  std::vector<double> errors(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    errors[i] = ((projection * scaling.point(points[i])).hnormalized() - scaling.pixel(points[i])).norm();
  }
  const double scale = 3 * std::max(median_of(errors), 1e-12);
  for (double& error : errors) error = robust_weight(error, scale);
  return errors;
}

/// K [R | t] by an RQ decomposition, with a proper rotation.
Resection decompose(Projection projection) {
  if (projection.leftCols<3>().determinant() < 0) projection = -projection;
  const Eigen::Matrix3d left = projection.leftCols<3>();
  const Eigen::Matrix3d flip = Eigen::Matrix3d::Identity().rowwise().reverse();
  const Eigen::HouseholderQR<Eigen::Matrix3d> qr((flip * left).transpose());
  const Eigen::Matrix3d q = qr.householderQ();
  const Eigen::Matrix3d r = qr.matrixQR().triangularView<Eigen::Upper>();
  Eigen::Matrix3d upper = flip * r.transpose() * flip;
  Eigen::Matrix3d rotation = flip * q.transpose();
  const Eigen::DiagonalMatrix<double, 3> signs(upper.diagonal().array().sign().matrix());
  upper = (upper * signs).eval();
  rotation = (signs * rotation).eval();
  const Eigen::Vector3d translation = upper.inverse() * projection.col(3);
  const Eigen::Matrix3d k = upper / upper(2, 2);
  return {{k(0, 0), k(1, 1), k(0, 2), k(1, 2), 0, 0, 0, 0, 0}, {rotation, translation}};
}

/// Tells whether the points lie behind the device. In a mirrored picture they do, because the rotation is proper.
bool lie_behind(std::span<const SpacePoint> points, const RigidTransform& device_from_points) {
  std::vector<double> depths;
  for (const SpacePoint& point : points) depths.push_back((device_from_points * point.point_mm).z());
  return median_of(std::move(depths)) < 0;
}

}  // namespace

Result<Resection> resect(std::span<const SpacePoint> points) {
  if (points.size() < kPointsMin) {
    return fail(ErrorCode::kImpossible, "only " + std::to_string(points.size()) +
                                            " of the projector's pixels were found on the board; " +
                                            std::to_string(kPointsMin) + " are needed");
  }
  const Scaling scaling(points);
  std::vector<double> weights(points.size(), 1);
  Projection projection;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::SelfAdjointEigenSolver<Normal> solver(normal_equations(points, scaling, weights));
    if (solver.eigenvalues()(1) < kRankTolerance * solver.eigenvalues()(11)) {
      return fail(
          ErrorCode::kImpossible,
          "all poses lie on one plane, which leaves the projector undetermined; tilt the board and vary its distance");
    }
    const Eigen::Matrix<double, 12, 1> solution = solver.eigenvectors().col(0);
    projection = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(solution.data());
    weights = weigh(points, scaling, projection);
  }
  const Resection solved = decompose(scaling.undo(projection));
  if (lie_behind(points, solved.device_from_points)) {
    return fail(ErrorCode::kImpossible,
                "the projector's or the camera's picture is mirrored: turn off rear projection and mirroring");
  }
  return solved;
}

}  // namespace slsd
