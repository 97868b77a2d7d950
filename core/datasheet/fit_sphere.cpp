// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/fit_sphere.hpp"

#include <Eigen/Eigenvalues>

namespace slsd {

std::optional<Sphere> fit_sphere(std::span<const Eigen::Vector3d> points, const Sphere& start) {
  constexpr int kSteps = 50;
  constexpr double kDoneMm = 1e-9, kLeastShare = 1e-9;
  if (points.size() < 4) return std::nullopt;
  Sphere sphere = start;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector3d ray = point - sphere.centre_mm;
      const double distance = ray.norm();
      if (!(distance > 0)) continue;
      Eigen::Vector4d derivative;
      derivative << -ray / distance, -1;
      normal += derivative * derivative.transpose();
      right += derivative * (distance - sphere.radius_mm);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> axes(normal);
    if (!(axes.eigenvalues()[0] > kLeastShare * axes.eigenvalues()[3])) return std::nullopt;
    const Eigen::Vector4d change =
        axes.eigenvectors() * (axes.eigenvectors().transpose() * right).cwiseQuotient(axes.eigenvalues());
    sphere.centre_mm -= change.head<3>(), sphere.radius_mm -= change[3];
    if (!change.allFinite() || !(sphere.radius_mm > 0)) return std::nullopt;
    if (change.norm() < kDoneMm) return sphere;
  }
  return std::nullopt;
}

}  // namespace slsd
