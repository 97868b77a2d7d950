// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/find_sphere.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <unordered_map>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

using Points = std::span<const Eigen::Vector3d>;

constexpr std::size_t kScored = 60'000;  // points among which a sphere is looked for
constexpr int kDraws = 6000;             // a sphere of a hundredth of the points is drawn sixty times
constexpr double kNearShare = 0.02;      // of the radius: distance of a point from the surface that speaks for it
constexpr std::size_t kPointsLeast = 30;
constexpr int kRefinements = 8;
constexpr double kGateSigmas = 8;
// Spread of the unit normals of an evenly seen cap of 60 degrees along its two axes is 0.4; of a cylinder, one is less
// than 0.15.
constexpr double kSpreadLeast = 0.25;
constexpr double kSizeShare = 0.05;  // a sphere whose size differs by more is another one

// Points by cubes, whose side is the radius.
class Neighbourhoods {
 public:
  Neighbourhoods(Points points, double side_mm) : points_(points), side_mm_(side_mm) {
    for (std::uint32_t i = 0; i < points.size(); ++i) cubes_[key(cube_of(points[i]))].push_back(i);
  }

  // Visits the points in the cubes around a place.
  template <class Visit>
  void around(const Eigen::Vector3d& place, const Visit& visit) const {
    const Eigen::Vector3i middle = cube_of(place);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const auto found = cubes_.find(key(middle + Eigen::Vector3i(x, y, z)));
          if (found == cubes_.end()) continue;
          for (const std::uint32_t i : found->second) visit(i);
        }
  }

 private:
  [[nodiscard]] Eigen::Vector3i cube_of(const Eigen::Vector3d& place) const {
    return (place / side_mm_).array().floor().cast<int>();
  }
  static std::uint64_t key(const Eigen::Vector3i& cube) {
    constexpr std::uint64_t kBits = 21, kMask = (1U << kBits) - 1;
    return (static_cast<std::uint64_t>(cube.x()) & kMask) | (static_cast<std::uint64_t>(cube.y()) & kMask) << kBits |
           (static_cast<std::uint64_t>(cube.z()) & kMask) << (2 * kBits);
  }

  Points points_;
  double side_mm_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cubes_;
};

// The sphere of a radius through three points, behind them as seen from the origin.
std::optional<Sphere> behind(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                             double radius_mm) {
  const Eigen::Vector3d ab = b - a, ac = c - a, across = ab.cross(ac);
  const double area2 = across.squaredNorm();
  if (area2 < 1e-6 * std::pow(radius_mm, 4)) return std::nullopt;  // nearly on a line
  const Eigen::Vector3d to_circle =
      (ac.squaredNorm() * across.cross(ab) + ab.squaredNorm() * ac.cross(across)) / (2 * area2);
  const double height2 = radius_mm * radius_mm - to_circle.squaredNorm();
  if (height2 < 0) return std::nullopt;
  const Eigen::Vector3d up = across * std::sqrt(height2 / area2);
  const Eigen::Vector3d one = a + to_circle + up, other = a + to_circle - up;
  return Sphere{one.squaredNorm() > other.squaredNorm() ? one : other, radius_mm};
}

bool in_cap(const Sphere& sphere, const Eigen::Vector3d& point) {
  static const double kLeast = std::cos(kCapDegrees * std::numbers::pi / 180);
  const Eigen::Vector3d out = point - sphere.centre_mm;
  return -out.dot(sphere.centre_mm) >= kLeast * out.norm() * sphere.centre_mm.norm();
}

std::optional<Sphere> draw_sphere(Points points, const Neighbourhoods& near, double radius_mm) {
  std::mt19937 random(1);
  std::optional<Sphere> best;
  std::size_t most = 0;
  std::vector<std::uint32_t> around;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::Vector3d& first = points[random() % points.size()];
    around.clear();
    near.around(first, [&](std::uint32_t i) { around.push_back(i); });
    if (around.size() < kPointsLeast) continue;
    const auto any = [&]() -> const Eigen::Vector3d& { return points[around[random() % around.size()]]; };
    const Eigen::Vector3d &second = any(), &third = any();
    const auto sphere = behind(first, second, third, radius_mm);
    if (!sphere) continue;
    const auto fits = [&](std::uint32_t i) {
      return std::abs(sphere->off_mm(points[i])) < kNearShare * radius_mm && in_cap(*sphere, points[i]);
    };
    const auto count = static_cast<std::size_t>(std::ranges::count_if(around, fits));
    if (count > most) most = count, best = sphere;
  }
  return most >= kPointsLeast ? best : std::nullopt;
}

// Least of the two spreads of the points' directions from the centre, across the direction to the scanner.
double spread_of(Points points, const SeenSphere& seen) {
  const Eigen::Vector3d axis = -seen.sphere.centre_mm.normalized();
  const Eigen::Vector3d one = axis.unitOrthogonal(), other = axis.cross(one);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (const std::size_t i : seen.points) {
    const Eigen::Vector3d out = (points[i] - seen.sphere.centre_mm).normalized();
    const Eigen::Vector2d across(out.dot(one), out.dot(other));
    sum += across, squares += across * across.transpose();
  }
  const auto count = static_cast<double>(seen.points.size());
  const Eigen::Vector2d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(Eigen::Matrix2d(squares / count - mean * mean.transpose()),
                                                            Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, axes.eigenvalues()[0]));
}

std::optional<SeenSphere> refine(Points points, const std::vector<char>& taken, const Sphere& start) {
  SeenSphere seen{start, {}};
  double gate = kNearShare * start.radius_mm;
  for (int round = 0; round < kRefinements; ++round) {
    std::vector<Eigen::Vector3d> used;
    std::vector<double> off;
    seen.points.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double distance = std::abs(seen.sphere.off_mm(points[i]));
      if (taken[i] != 0 || distance > gate || !in_cap(seen.sphere, points[i])) continue;
      seen.points.push_back(i), used.push_back(points[i]), off.push_back(distance);
    }
    const auto fitted = fit_sphere(used, seen.sphere);
    if (!fitted) return std::nullopt;
    seen.sphere = *fitted;
    gate = std::min(kNearShare * start.radius_mm, kGateSigmas * kSigmaOfMedian * median_of(std::move(off)));
  }
  return seen;
}

}  // namespace

std::vector<SeenSphere> find_spheres(std::span<const Eigen::Vector3d> points, double diameter_mm, std::size_t most) {
  const double radius_mm = diameter_mm / 2;
  std::vector<char> taken(points.size(), 0);
  std::vector<SeenSphere> found;
  while (found.size() < most) {
    std::vector<Eigen::Vector3d> scored;
    const std::size_t stride = points.size() / kScored + 1;
    for (std::size_t i = 0; i < points.size(); i += stride)
      if (taken[i] == 0) scored.push_back(points[i]);
    if (scored.size() < kPointsLeast) break;
    const auto drawn = draw_sphere(scored, Neighbourhoods(scored, radius_mm), radius_mm);
    if (!drawn) break;
    auto seen = refine(points, taken, *drawn);
    if (!seen || spread_of(points, *seen) < kSpreadLeast ||
        std::abs(seen->sphere.radius_mm - radius_mm) > kSizeShare * radius_mm)
      break;
    for (std::size_t i = 0; i < points.size(); ++i)
      if ((points[i] - seen->sphere.centre_mm).norm() < 1.2 * radius_mm) taken[i] = 1;
    found.push_back(std::move(*seen));
  }
  return found;
}

}  // namespace slsd
