// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/hand_eye_verdict.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr double kChiSquared95 = 7.8147;  // of three dimensions

double worst_sigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()[2]));
}

}  // namespace

double ellipse_squared(double freedom) {
  return kChiSquared95 * (1 + (kChiSquared95 - 1) / (2 * std::max(1.0, freedom)));
}

HandEyeVerdict judge_hand_eye(const HandEyeFit& fit, double distance_mm) {
  const Eigen::Vector3d lever = fit.places.mount_from_rig.rotation * Eigen::Vector3d(0, 0, distance_mm);
  Eigen::Matrix<double, 3, 6> by_change;
  by_change << 0, lever.z(), -lever.y(), 1, 0, 0,  //
      -lever.z(), 0, lever.x(), 0, 1, 0,           //
      lever.y(), -lever.x(), 0, 0, 0, 1;
  const Eigen::Matrix<double, 6, 6> scanner = fit.covariance.topLeftCorner<6, 6>();
  HandEyeVerdict verdict;
  verdict.distance_mm = distance_mm;
  verdict.sigma_mm = worst_sigma(by_change * scanner * by_change.transpose());
  verdict.error_mm = std::sqrt(ellipse_squared(fit.freedom)) * verdict.sigma_mm;
  verdict.turn_sigma_rad = worst_sigma(scanner.topLeftCorner<3, 3>());
  verdict.place_sigma_mm = worst_sigma(scanner.bottomRightCorner<3, 3>());
  return verdict;
}

HandEyeGrade grade(const HandEyeVerdict& verdict) {
  if (verdict.error_mm <= kGoodHandEyeMm) return HandEyeGrade::kGood;
  return verdict.error_mm <= kUsableHandEyeMm ? HandEyeGrade::kUsable : HandEyeGrade::kBad;
}

std::string_view to_string(HandEyeGrade grade) {
  switch (grade) {
    case HandEyeGrade::kGood:
      return "good";
    case HandEyeGrade::kUsable:
      return "usable";
    case HandEyeGrade::kBad:
      break;
  }
  return "bad";
}

Eigen::Vector3d turns_by_axis(std::span<const HandEyeView> views) {
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double pairs = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::AngleAxisd turn(views[i].base_from_flange.rotation.transpose() * views[j].base_from_flange.rotation);
      squares += turn.angle() * turn.angle() * turn.axis() * turn.axis().transpose();
      ++pairs;
    }
  }
  const Eigen::Matrix3d mean = squares / std::max(1.0, pairs);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(mean).eigenvalues().cwiseMax(0).cwiseSqrt().reverse();
}

}  // namespace slsd
