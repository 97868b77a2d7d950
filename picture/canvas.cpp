// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace slsd {
namespace {

// The letters from space to ~ as strokes. Each point has two characters: a digit for x, and a letter for y. The letter
// runs from a (4 below the base line e) to q (the height of a capital). A space lifts the pen.
constexpr std::array<std::string_view, 95> kStrokes{
    "", "0q0h 0f0e", "0q0n 3q3n", "2e3q 5e6q 0i8i 0m8m", "7o5q2q0o0m2k5k7i7g5e2e0g 3d4r",
    "0e8q 1n1p2q3p3n2m1n 5f5h6i7h7f6e5f", "8e1n1p2q4q5p5n0i0g2e4e8i", "0q0n", "3r0o0g3d", "0r3o3g0d", "3h3n 0i6m 0m6i",
    "3g3m 0j6j", "1f1e0c", "0j5j", "0e0f", "0d6r",
    // 0 to 9
    "2e0g0o2q5q7o7g5e2e", "1o4q4e7e1e", "0o2q5q7o7m0e7e", "0o2q5q7o7m5k7i7g5e2e0g 2k5k", "5e5q0h7h",
    "7q1q0k2l5l7j7g5e2e0g", "7p5q3q0n0g2e5e7g7i5k2k0i", "0q7q3e", "2k0m0o2q5q7o7m5k2k0i0g2e5e7g7i5k",
    "7m5k2k0m0o2q5q7o7i4e1f",
    // : to @
    "0e0f 0l0m", "1l1m 1f1e0c", "6m0j6g", "0l6l 0h6h", "0m6j0g", "0o2q4q6o6m3j3h 3f3e",
    "6h5g3g2h2l3m5m6l6g8h8o6q2q0o0g2e6e",
    // A to Z
    "0e4q8e 1i7i", "0e0q5q7o7m5k0k 5k7i7g5e0e", "7o5q2q0o0g2e5e7g", "0e0q4q7n7h4e0e", "7q0q0e7e 0k5k", "7q0q0e 0k5k",
    "7o5q2q0o0g2e5e7g7k4k", "0e0q 7e7q 0k7k", "0e0q", "5q5g3e2e0g", "0e0q 7q0j 2l7e", "0q0e6e", "0e0q4g8q8e",
    "0e0q7e7q", "2e0g0o2q6q8o8g6e2e", "0e0q5q7o7m5k0k", "2e0g0o2q6q8o8g6e2e 5h8d", "0e0q5q7o7m5k0k 4k7e",
    "7o5q2q0o0m2k5k7i7g5e2e0g", "0q8q 4q4e", "0q0g2e5e7g7q", "0q4e8q", "0q2e4n6e8q", "0e7q 0q7e", "0q4k8q 4k4e",
    "0q7q0e7e",
    // [ to `
    "3r0r0c3c", "0r6d", "0r3r3c0c", "0n3q6n", "0d7d", "0q2o",
    // a to z
    "6m6e 6k4m2m0k0g2e4e6g", "0q0e 0k2m4m6k6g4e2e0g", "6k4m2m0k0g2e4e6g", "6q6e 6k4m2m0k0g2e4e6g",
    "0i6i6k4m2m0k0g2e4e6g", "5q3q2o2e 0m4m", "6m6c4a2a0b 6k4m2m0k0g2e4e6g", "0q0e 0k2m4m6k6e", "0m0e 0p0q",
    "2m2b0a 2p2q", "0q0e 5m0h 2j6e", "0q0e", "0m0e 0k2m3m4k4e 4k6m7m8k8e", "0m0e 0k2m4m6k6e", "2e0g0k2m4m6k6g4e2e",
    "0m0a 0k2m4m6k6g4e2e0g", "6m6a 6k4m2m0k0g2e4e6g", "0m0e 0j2m4m", "6l4m2m0l0k2j4j6h6f4e2e0f", "2q2g4e5e 0m5m",
    "0m0g2e4e6g 6m6e", "0m3e6m", "0m2e4k6e8m", "0e6m 0m6e", "0m3e 6m3e2b0a", "0m6m0e6e",
    // { to ~
    "4r2q2l0j2i2d4c", "0r0c", "0r2q2l4j2i2d0c", "0i1k2k4i5i6k"};
constexpr double kCapital = 12;  // in these units
constexpr double kGap = 3;       // between two letters
constexpr double kSpace = 3;     // the width of a space

std::string_view strokes_of(char letter) {
  const bool drawn = letter >= ' ' && letter <= '~';
  return kStrokes[static_cast<std::size_t>((drawn ? letter : '?') - ' ')];
}

double width_of(std::string_view strokes) {
  double width = strokes.empty() ? kSpace : 0;
  for (const char sign : strokes)
    if (sign >= '0' && sign <= '8') width = std::max(width, double(sign - '0'));
  return width;
}

double stroke_px(double height_px) {
  return std::max(1.0, height_px / 11.0);
}

// The share of a pixel inside a shape, from the distance of its centre to the shape's middle.
double covered(double distance_px, double half_width_px) {
  return std::clamp(half_width_px + 0.5 - distance_px, 0.0, 1.0);
}

// The whole numbers above `low` and below `high` that lie within a side of the picture.
struct Pixels {
  int first, last;
  Pixels(double low, double high, int side)
      : first(static_cast<int>(std::clamp(std::ceil(low), 0.0, double(side)))),
        last(static_cast<int>(std::clamp(std::floor(high), -1.0, side - 1.0))) {}
};

// Colours each pixel within reach of a stroke between two points. Follows the longer side, so the cost of a thin line
// grows only with its length.
void stroke(ColourImage& picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, double width_px) {
  const Eigen::Vector2d along = to - from;
  const double squared = along.squaredNorm(), reach = 0.5 * width_px + 0.5;
  if (!std::isfinite(squared)) return;
  const int major = std::abs(along.x()) >= std::abs(along.y()) ? 0 : 1, minor = 1 - major;
  const std::array<int, 2> sides{picture.width(), picture.height()};
  const double slope = along[major] != 0 ? along[minor] / along[major] : 0;
  const double across = reach * std::sqrt(1 + slope * slope);
  const auto [low, high] = std::minmax(from[major], to[major]);
  const Pixels run(low - reach, high + reach, sides[static_cast<std::size_t>(major)]);
  Eigen::Vector2d pixel;
  for (int i = run.first; i <= run.last; ++i) {
    pixel[major] = i;
    const double middle = from[minor] + slope * (i - from[major]);
    const Pixels fall(middle - across, middle + across, sides[static_cast<std::size_t>(minor)]);
    for (int j = fall.first; j <= fall.last; ++j) {
      pixel[minor] = j;
      const double share = squared > 0 ? std::clamp((pixel - from).dot(along) / squared, 0.0, 1.0) : 0;
      Rgb& place = picture.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
      place = mix(place, colour, covered((pixel - from - share * along).norm(), 0.5 * width_px));
    }
  }
}

}  // namespace

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, int thickness_px) {
  stroke(picture_, from, to, colour, thickness_px);
}

void Canvas::dashes(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, int thickness_px,
                    double dash_px) {
  const double length = (to - from).norm();
  for (double at = 0; at < length; at += 2 * dash_px) {
    const double end = std::min(at + dash_px, length);
    line(from + at / length * (to - from), from + end / length * (to - from), colour, thickness_px);
  }
}

void Canvas::disc(const Eigen::Vector2d& centre, double radius_px, Rgb colour) {
  stroke(picture_, centre, centre, colour, 2 * radius_px);
}

void Canvas::plus(const Eigen::Vector2d& centre, double arm_px, Rgb colour, int thickness_px) {
  const Eigen::Vector2d across(arm_px, 0), down(0, arm_px);
  line(centre - across, centre + across, colour, thickness_px);
  line(centre - down, centre + down, colour, thickness_px);
}

void Canvas::rectangle(int left, int top, int width, int height, Rgb colour) {
  const int right = std::min(left + width, picture_.width()), bottom = std::min(top + height, picture_.height());
  for (int y = std::max(top, 0); y < bottom; ++y) {
    for (int x = std::max(left, 0); x < right; ++x) picture_.at(x, y) = colour;
  }
}

void Canvas::text(const Eigen::Vector2d& place, const std::string& words, double height_px, Rgb colour, Align align) {
  const double share = align == Align::kLeft ? 0.0 : align == Align::kCentre ? 0.5 : 1.0;
  const double unit_px = height_px / kCapital;
  Eigen::Vector2d origin(std::round(place.x() - share * text_width_px(words, height_px)), std::round(place.y()));
  for (const char letter : words) {
    const std::string_view strokes = strokes_of(letter);
    const auto point = [&](std::size_t i) -> Eigen::Vector2d {
      return origin + unit_px * Eigen::Vector2d(strokes[i] - '0', 'e' - strokes[i + 1]);
    };
    for (std::size_t i = 0; i + 3 < strokes.size();) {
      const bool lifted = strokes[i + 2] == ' ';
      if (!lifted) stroke(picture_, point(i), point(i + 2), colour, stroke_px(height_px));
      i += lifted ? 3 : 2;
    }
    origin.x() += unit_px * (width_of(strokes) + kGap);
  }
}

double Canvas::text_width_px(const std::string& words, double height_px) {
  double units = words.empty() ? 0 : -kGap;
  for (const char letter : words) units += width_of(strokes_of(letter)) + kGap;
  return units * height_px / kCapital;
}

Rgb mix(Rgb a, Rgb b, double share) {
  Rgb mixed;
  for (std::size_t i = 0; i < 3; ++i) {
    mixed[i] = static_cast<std::uint8_t>(std::lround(a[i] + std::clamp(share, 0.0, 1.0) * (b[i] - a[i])));
  }
  return mixed;
}

}  // namespace slsd
