// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/homography.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr int kRounds = 6;

/// Moves the points' mean to the origin and scales their mean distance from it to sqrt(2).
Eigen::Matrix3d normalisation(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) middle += point / static_cast<double>(points.size());
  double distance = 0;
  for (const Eigen::Vector2d& point : points) distance += (point - middle).norm() / static_cast<double>(points.size());
  const double scale = distance > 0 ? std::sqrt(2.0) / distance : 1;
  Eigen::Matrix3d matrix;
  matrix << scale, 0, -scale * middle.x(), 0, scale, -scale * middle.y(), 0, 0, 1;
  return matrix;
}

Homography solve(std::span<const Eigen::Vector2d> from, std::span<const Eigen::Vector2d> to,
                 const std::vector<double>& weights) {
  const Eigen::Matrix3d from_scale = normalisation(from), to_scale = normalisation(to);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::RowVector3d p = (from_scale * from[i].homogeneous()).transpose();
    const Eigen::Vector2d q = (to_scale * to[i].homogeneous()).hnormalized();
    Eigen::Matrix<double, 2, 9> rows;
    rows << p, Eigen::RowVector3d::Zero(), -q.x() * p, Eigen::RowVector3d::Zero(), p, -q.y() * p;
    normal += weights[i] * rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(normal);
  const Eigen::Matrix3d scaled =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(solver.eigenvectors().col(0).eval().data());
  const Eigen::Matrix3d homography = to_scale.inverse() * scaled * from_scale;
  return {homography / homography(2, 2)};
}

}  // namespace

Eigen::Vector2d Homography::map(const Eigen::Vector2d& point) const {
  return (matrix * point.homogeneous()).hnormalized();
}

Eigen::Matrix2d Homography::jacobian(const Eigen::Vector2d& point) const {
  const Eigen::Vector3d p = matrix * point.homogeneous();
  return (matrix.topLeftCorner<2, 2>() - p.hnormalized() * matrix.bottomLeftCorner<1, 2>()) / p.z();
}

Homography Homography::inverse() const {
  return {matrix.inverse()};
}

Homography fit_robust_homography(std::span<const Eigen::Vector2d> from, std::span<const Eigen::Vector2d> to) {
  std::vector<double> weights(from.size(), 1), distances(from.size());
  Homography homography = solve(from, to, weights);
  for (int round = 0; round < kRounds && from.size() > 4; ++round) {
    for (std::size_t i = 0; i < from.size(); ++i) distances[i] = (homography.map(from[i]) - to[i]).norm();
    const double scale = std::max(median_of(distances), 1e-9);
    for (std::size_t i = 0; i < from.size(); ++i) weights[i] = robust_weight(distances[i], 3 * scale);
    homography = solve(from, to, weights);
  }
  return homography;
}

}  // namespace slsd
