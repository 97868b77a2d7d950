// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/plane_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

using Points = std::span<const Eigen::Vector3d>;

constexpr int kDraws = 100;           // with half of the points off the plane, all but one in a million sets of draws
                                      // find it
constexpr std::size_t kScored = 500;  // points by which a draw is judged
constexpr int kRefinements = 5;
constexpr double kGateSigmas = 5;
constexpr double kGateMinMm = 1e-6;  // for points without noise
constexpr double kLineShare = 1e-9;  // share of the largest variance: below, the points lie on a line

std::vector<double> offsets(Points points, const PlaneFit& plane) {
  std::vector<double> out;
  out.reserve(points.size());
  for (const Eigen::Vector3d& point : points) out.push_back(plane.off_mm(point));
  return out;
}

double median_offset(Points points, const PlaneFit& plane) {
  const std::size_t step = std::max<std::size_t>(1, points.size() / kScored);
  std::vector<double> off;
  for (std::size_t i = 0; i < points.size(); i += step) off.push_back(std::abs(plane.off_mm(points[i])));
  return median_in_place(off);
}

std::optional<PlaneFit> through_three(Points points, std::mt19937& random) {
  const auto draw = [&]() -> const Eigen::Vector3d& { return points[random() % points.size()]; };
  const Eigen::Vector3d &a = draw(), &b = draw(), &c = draw();
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  if (!(normal.norm() > 0)) return std::nullopt;
  return PlaneFit{a, normal.normalized(), {}, 0};
}

std::optional<PlaneFit> best_draw(Points points) {
  std::mt19937 random(1);
  std::optional<PlaneFit> best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kDraws; ++i) {
    const auto plane = through_three(points, random);
    const double off = plane ? median_offset(points, *plane) : least;
    if (off < least) best = plane, least = off;
  }
  return best;
}

std::optional<PlaneFit> least_squares(Points points, std::vector<std::size_t> used) {
  PlaneFit plane;
  if (used.size() < 3) return std::nullopt;
  const auto count = static_cast<double>(used.size());
  for (const std::size_t i : used) plane.middle += points[i] / count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const std::size_t i : used) spread += (points[i] - plane.middle) * (points[i] - plane.middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  if (!(axes.eigenvalues()[1] > kLineShare * axes.eigenvalues()[2])) return std::nullopt;
  plane.normal = axes.eigenvectors().col(0);
  if (plane.normal.dot(plane.middle) < 0) plane.normal = -plane.normal;
  plane.rms_mm = std::sqrt(std::max(0.0, axes.eigenvalues()[0]) / count);
  plane.on_plane = std::move(used);
  return plane;
}

std::vector<std::size_t> near(Points points, const PlaneFit& plane) {
  std::vector<double> distances = offsets(points, plane);
  for (double& distance : distances) distance = std::abs(distance);
  const double gate = std::max(kGateMinMm, kGateSigmas * kSigmaOfMedian * median_of(distances));
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (distances[i] <= gate) used.push_back(i);
  }
  return used;
}

}  // namespace

Eigen::Vector3d PlaneFit::meet(const Eigen::Vector2d& direction) const {
  const Eigen::Vector3d ray = direction.homogeneous();
  return normal.dot(middle) / normal.dot(ray) * ray;
}

std::optional<PlaneFit> fit_plane(Points points) {
  if (points.size() < 3) return std::nullopt;
  std::optional<PlaneFit> plane = best_draw(points);
  for (int i = 0; plane && i < kRefinements; ++i) plane = least_squares(points, near(points, *plane));
  return plane;
}

}  // namespace slsd
