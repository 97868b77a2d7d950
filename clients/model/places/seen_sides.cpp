// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/seen_sides.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace slsd::model {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
/// An axis is known once the object has turned so far in all.
constexpr double kLeastTurnDegrees = 5;
/// So far an angle may lie below that of the first view by rounding alone.
constexpr double kRoundingDegrees = 1e-6;

struct Turning {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< in the object's frame, along the turn of the views
  double turned_degrees = 0;
};

/// The axis that most of the turns share: the first principal axis of their rotation vectors.
Turning turning_of(std::span<const RigidTransform> places) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Turning turning;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const Eigen::AngleAxisd step(Eigen::Matrix3d(places[i].rotation * places[i - 1].rotation.transpose()));
    const Eigen::Vector3d turn = step.angle() * step.axis();
    scatter += turn * turn.transpose();
    sum += turn;
    turning.turned_degrees += step.angle() * kDegrees;
  }
  if (turning.turned_degrees < kLeastTurnDegrees) return turning;
  turning.axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
  if (turning.axis.dot(sum) < 0) turning.axis = -turning.axis;
  return turning;
}

}  // namespace

SeenSides seen_sides(std::span<const RigidTransform> object_from_rig, const Eigen::Vector3d& middle_mm) {
  SeenSides sides;
  if (object_from_rig.empty()) return sides;
  const Turning turning = turning_of(object_from_rig);
  if (turning.axis.isZero()) return sides;
  const auto across = [&](const RigidTransform& place) {
    const Eigen::Vector3d ray = place.translation - middle_mm;
    return Eigen::Vector3d(ray - turning.axis * turning.axis.dot(ray));
  };
  const Eigen::Vector3d first = across(object_from_rig.front()).normalized();
  const Eigen::Vector3d second = turning.axis.cross(first);
  std::vector<double> angles;
  for (const RigidTransform& place : object_from_rig) {
    const Eigen::Vector3d ray = across(place);
    const double angle = std::atan2(ray.dot(second), ray.dot(first)) * kDegrees;
    angles.push_back(angle < -kRoundingDegrees ? angle + 360 : std::max(0.0, angle));
  }
  sides.views_degrees = angles;
  std::ranges::sort(angles);
  sides.gap_begins_degrees = angles.back();
  sides.gap_degrees = 360 - angles.back() + angles.front();
  for (std::size_t i = 1; i < angles.size(); ++i) {
    if (angles[i] - angles[i - 1] <= sides.gap_degrees) continue;
    sides.gap_begins_degrees = angles[i - 1];
    sides.gap_degrees = angles[i] - angles[i - 1];
  }
  sides.seen_degrees = 360 - sides.gap_degrees;
  return sides;
}

std::string to_string(const SeenSides& sides) {
  if (sides.all()) return "seen from all sides";
  if (sides.seen_degrees <= 0) return "seen from one side: turn the object";
  return fmt::format("seen {:.0f} of 360 degrees; missing: {:.0f} to {:.0f} degrees after the first view",
                     sides.seen_degrees, sides.gap_begins_degrees, sides.gap_begins_degrees + sides.gap_degrees);
}

}  // namespace slsd::model
