// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/convex_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slsd {
namespace {

using Point = Eigen::Vector2d;

double cross(const Point& a, const Point& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// The hull's corners are among those of the first and the last lit pixel of each row.
std::vector<Point> outer_corners(const ImageView<std::uint8_t>& mask) {
  std::vector<Point> corners;
  for (int y = 0; y < mask.height; ++y) {
    const std::uint8_t* row = mask.row(y);
    const std::uint8_t* end = row + mask.width;
    const auto lit = [](std::uint8_t value) { return value != 0; };
    const std::uint8_t* first = std::find_if(row, end, lit);
    if (first == end) continue;
    while (end[-1] == 0) --end;
    for (const double below : {-0.5, 0.5}) {
      corners.emplace_back(static_cast<double>(first - row) - 0.5, y + below);
      corners.emplace_back(static_cast<double>(end - row) - 0.5, y + below);
    }
  }
  return corners;
}

// Appends to a chain that turns in one direction only.
void extend(std::vector<Point>& chain, std::size_t fixed, const Point& point) {
  while (chain.size() > fixed + 1 && cross(chain.back() - chain[chain.size() - 2], point - chain.back()) <= 0) {
    chain.pop_back();
  }
  chain.push_back(point);
}

double rectangle_area_along(const Point& side, const std::vector<Point>& hull) {
  const Point across(-side.y(), side.x());
  Point low = Point::Constant(std::numeric_limits<double>::max());
  Point high = -low;
  for (const Point& point : hull) {
    const Point turned(side.dot(point), across.dot(point));
    low = low.cwiseMin(turned);
    high = high.cwiseMax(turned);
  }
  return (high - low).prod();
}

}  // namespace

std::vector<Point> convex_hull(const ImageView<std::uint8_t>& mask) {
  std::vector<Point> points = outer_corners(mask);
  if (points.empty()) return points;
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::vector<Point> hull;
  for (const Point& point : points) extend(hull, 0, point);
  const std::size_t turn = hull.size() - 1;
  for (auto point = points.rbegin() + 1; point != points.rend(); ++point) extend(hull, turn, *point);
  hull.pop_back();
  return hull;
}

double polygon_area(const std::vector<Point>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return std::abs(twice) / 2;
}

double least_rectangle_area(const std::vector<Point>& hull) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point side = hull[(i + 1) % hull.size()] - hull[i];
    least = std::min(least, rectangle_area_along(side.normalized(), hull));
  }
  return least;
}

}  // namespace slsd
