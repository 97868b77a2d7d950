// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/measure_artefact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "core/datasheet/find_sphere.hpp"
#include "core/geometry/plane_fit.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr double kLeftOutShare = 0.003;
constexpr double kHalfNormalMedian = 0.6745;  // median of the absolute value of a standard normal number
constexpr std::size_t kPlaneScored = 20'000;
constexpr double kPlateGateSigmas = 20;  // farther points belong to other things than the plate
constexpr double kPlateGateLeastMm = 0.05;
constexpr std::size_t kPlatePoints = 100;
constexpr double kSpacingShare = 0.1;

std::vector<Eigen::Vector3d> places_of(std::span<const DensePoint> points, std::span<const std::size_t> chosen) {
  std::vector<Eigen::Vector3d> places;
  places.reserve(chosen.size());
  for (const std::size_t i : chosen) places.push_back(points[i].place_mm.cast<double>());
  return places;
}

std::vector<Eigen::Vector3d> all_places(std::span<const DensePoint> points) {
  std::vector<std::size_t> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  return places_of(points, all);
}

// Leaves out the points that are farthest from the surface, three in a thousand.
template <class OffOf>
void leave_out_farthest(std::vector<std::size_t>& chosen, const OffOf& off_of) {
  const auto kept = chosen.size() - static_cast<std::size_t>(kLeftOutShare * static_cast<double>(chosen.size()));
  std::ranges::nth_element(chosen, chosen.begin() + static_cast<std::ptrdiff_t>(kept), {},
                           [&](std::size_t i) { return std::abs(off_of(i)); });
  chosen.resize(kept);
}

double shortest_interval(const std::vector<double>& sorted, double share) {
  const auto held = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  double shortest = sorted.back() - sorted.front();
  for (std::size_t i = 0; i + held <= sorted.size(); ++i)
    shortest = std::min(shortest, sorted[i + held - 1] - sorted[i]);
  return shortest;
}

// @param off_of     signed distance of a point from the surface, by index
// @param normal_of  the surface's unit normal there
template <class OffOf, class NormalOf>
Form form_of(std::span<const DensePoint> points, std::span<const std::size_t> kept, std::size_t left_out,
             const OffOf& off_of, const NormalOf& normal_of) {
  Form form{.points = kept.size() + left_out, .left_out = left_out};
  std::vector<double> off, over_sigma;
  double squares = 0;
  for (const std::size_t i : kept) {
    off.push_back(off_of(i));
    squares += off.back() * off.back();
    const double slope = std::abs(normal_of(i).dot(points[i].place_mm.cast<double>().normalized()));
    over_sigma.push_back(std::abs(off.back()) / (slope * points[i].sigma_mm));
  }
  std::ranges::sort(off);
  form.range_mm = off.back() - off.front();
  form.range_95_mm = shortest_interval(off, 0.95);
  form.rms_mm = std::sqrt(squares / static_cast<double>(off.size()));
  form.error_over_sigma = median_of(std::move(over_sigma)) / kHalfNormalMedian;
  return form;
}

// The plane of least squares, and the extent of the points along it.
struct Plane {
  Eigen::Vector3d middle, normal, along;

  [[nodiscard]] double off_mm(const Eigen::Vector3d& point) const { return normal.dot(point - middle); }
};

Plane plane_through(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) middle += point;
  middle /= static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) spread += (point - middle) * (point - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  return {middle, axes.eigenvectors().col(0), axes.eigenvectors().col(2)};
}

}  // namespace

Result<PlateFigures> measure_plate(std::span<const DensePoint> points) {
  std::vector<Eigen::Vector3d> scored;
  for (std::size_t i = 0; i < points.size(); i += points.size() / kPlaneScored + 1)
    scored.push_back(points[i].place_mm.cast<double>());
  const auto first = fit_plane(scored);
  if (!first) return fail(ErrorCode::kNotFound, fmt::format("no plane among {} points", points.size()));
  const double gate = std::max(kPlateGateSigmas * first->rms_mm, kPlateGateLeastMm);
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (std::abs(first->off_mm(points[i].place_mm.cast<double>())) <= gate) chosen.push_back(i);
  if (chosen.size() < kPlatePoints)
    return fail(ErrorCode::kNotFound, fmt::format("only {} points lie on a plane", chosen.size()));
  const std::size_t all = chosen.size();
  Plane plane = plane_through(places_of(points, chosen));
  leave_out_farthest(chosen, [&](std::size_t i) { return plane.off_mm(points[i].place_mm.cast<double>()); });
  plane = plane_through(places_of(points, chosen));
  PlateFigures figures;
  figures.form = form_of(
      points, chosen, all - chosen.size(),
      [&](std::size_t i) { return plane.off_mm(points[i].place_mm.cast<double>()); },
      [&](std::size_t) { return plane.normal; });
  double least = 0, most = 0;
  for (const std::size_t i : chosen) {
    const double place = plane.along.dot(points[i].place_mm.cast<double>() - plane.middle);
    least = std::min(least, place), most = std::max(most, place);
  }
  figures.long_side_mm = most - least;
  figures.distance_mm = plane.middle.norm();
  figures.tilt_deg =
      std::acos(std::min(1.0, std::abs(plane.normal.dot(plane.middle.normalized())))) * 180 / std::numbers::pi;
  return figures;
}

Result<SphereFigures> measure_sphere(std::span<const DensePoint> points, double diameter_mm) {
  const std::vector<Eigen::Vector3d> places = all_places(points);
  auto found = find_spheres(places, diameter_mm, 1);
  if (found.empty())
    return fail(ErrorCode::kNotFound,
                fmt::format("no sphere of {} mm is visible from its top to 60 degrees around it", diameter_mm));
  std::vector<std::size_t>& chosen = found.front().points;
  const std::size_t all = chosen.size();
  Sphere sphere = found.front().sphere;
  leave_out_farthest(chosen, [&](std::size_t i) { return sphere.off_mm(places[i]); });
  sphere = fit_sphere(places_of(points, chosen), sphere).value_or(sphere);
  SphereFigures figures;
  figures.sphere = sphere;
  figures.size_error_mm = 2 * sphere.radius_mm - diameter_mm;
  figures.form = form_of(
      points, chosen, all - chosen.size(), [&](std::size_t i) { return sphere.off_mm(places[i]); },
      [&](std::size_t i) -> Eigen::Vector3d { return (places[i] - sphere.centre_mm).normalized(); });
  return figures;
}

Result<BarFigures> measure_bar(std::span<const DensePoint> points, double diameter_mm, double spacing_mm) {
  const auto found = find_spheres(all_places(points), diameter_mm, 2);
  if (found.size() < 2) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{} of the bar's two spheres of {} mm visible from the top to 60 degrees around",
                            found.empty() ? "none is" : "only one is", diameter_mm));
  }
  BarFigures figures{found[0].sphere, found[1].sphere};
  const double spacing = (figures.first.centre_mm - figures.second.centre_mm).norm();
  figures.spacing_error_mm = spacing - spacing_mm;
  if (std::abs(figures.spacing_error_mm) > kSpacingShare * spacing_mm) {
    return fail(ErrorCode::kMismatch,
                fmt::format("two spheres are {:.1f} mm apart, but the bar's should be {} mm apart: clear the view, or "
                            "correct the bar's length",
                            spacing, spacing_mm));
  }
  return figures;
}

}  // namespace slsd
