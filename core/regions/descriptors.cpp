// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/descriptors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/regions/convex_hull.hpp"

namespace slsd {
namespace {

using Mask = ImageView<std::uint8_t>;

bool lit(const Mask& mask, int x, int y) {
  return mask.contains(x, y) && mask.at(x, y) != 0;
}

struct Moments {
  double m00 = 0;
  Eigen::Vector2d centroid{0, 0};
  double mu20 = 0, mu11 = 0, mu02 = 0;  // divided by m00
};

Moments measure_moments(const Mask& mask) {
  double m00 = 0, m10 = 0, m01 = 0, m20 = 0, m11 = 0, m02 = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) == 0) continue;
      m00 += 1;
      m10 += x;
      m01 += y;
      m20 += double(x) * x;
      m11 += double(x) * y;
      m02 += double(y) * y;
    }
  }
  if (m00 == 0) return {};
  const Eigen::Vector2d c(m10 / m00, m01 / m00);
  return {m00, c, m20 / m00 - c.x() * c.x() + 1. / 12, m11 / m00 - c.x() * c.y(), m02 / m00 - c.y() * c.y() + 1. / 12};
}

// l2 / l1 of the eigenvalues of the second moments.
double eigenvalue_ratio(const Moments& m) {
  const double mean = (m.mu20 + m.mu02) / 2;
  const double half_difference = std::hypot((m.mu20 - m.mu02) / 2, m.mu11);
  return std::max(0., mean - half_difference) / (mean + half_difference);
}

double orientation_rad(const Moments& m) {
  const double angle = 0.5 * std::atan2(2 * m.mu11, m.mu20 - m.mu02);
  return angle <= -std::numbers::pi / 2 ? angle + std::numbers::pi : angle;
}

// Counts of 2x2 neighbourhoods by their number of lit pixels.
struct BitQuads {
  int one = 0, adjacent = 0, three = 0, diagonal = 0;

  [[nodiscard]] double perimeter() const { return adjacent + (one + three + 2 * diagonal) / std::numbers::sqrt2; }
  [[nodiscard]] int euler_number() const { return (one - three - 2 * diagonal) / 4; }
};

BitQuads count_quads(const Mask& mask) {
  BitQuads quads;
  for (int y = -1; y < mask.height; ++y) {
    for (int x = -1; x < mask.width; ++x) {
      const bool a = lit(mask, x, y), b = lit(mask, x + 1, y), c = lit(mask, x, y + 1), d = lit(mask, x + 1, y + 1);
      const int count = a + b + c + d;
      quads.one += count == 1;
      quads.three += count == 3;
      quads.diagonal += count == 2 && a == d;
      quads.adjacent += count == 2 && a != d;
    }
  }
  return quads;
}

// Lit pixels and holes: everything that a flood fill from outside over 4-connected dark pixels does not reach.
double filled_area(const Mask& mask) {
  const int width = mask.width + 2, height = mask.height + 2;
  std::vector<char> outside(static_cast<std::size_t>(width) * height, 0);
  std::vector<std::pair<int, int>> front{{0, 0}};
  outside[0] = 1;
  int reached = 1;
  while (!front.empty()) {
    const auto [x, y] = front.back();
    front.pop_back();
    for (const auto& [i, j] : {std::pair{x + 1, y}, {x - 1, y}, {x, y + 1}, {x, y - 1}}) {
      if (i < 0 || j < 0 || i >= width || j >= height || lit(mask, i - 1, j - 1)) continue;
      char& seen = outside[static_cast<std::size_t>(j) * width + i];
      if (seen) continue;
      seen = 1;
      ++reached;
      front.emplace_back(i, j);
    }
  }
  return double(width) * height - reached;
}

}  // namespace

Descriptors describe_shape(const ImageView<std::uint8_t>& mask) {
  const Moments moments = measure_moments(mask);
  const double area = moments.m00;
  if (area == 0) return {};
  const auto hull = convex_hull(mask);
  const double ratio = eigenvalue_ratio(moments);
  const BitQuads quads = count_quads(mask);
  return {.rectangularity = area / least_rectangle_area(hull),
          .eccentricity = std::sqrt(1 - ratio),
          .aspect_ratio = std::sqrt(ratio),
          .convex_to_area = polygon_area(hull) / area,
          .perimeter_to_area = quads.perimeter() / area,
          .area_px = area,
          .orientation_rad = orientation_rad(moments),
          .equivalent_diameter_px = std::sqrt(4 * area / std::numbers::pi),
          .filled_area_ratio = area / filled_area(mask),
          .euler_number = quads.euler_number(),
          .centroid_px = moments.centroid};
}

Descriptors describe_shape(const Grey8& mask) {
  return describe_shape(mask.view());
}

}  // namespace slsd
