// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/sign.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "picture/canvas.hpp"

namespace slsd {
namespace {

using Eigen::Vector2d;

constexpr double kHalfHeight = 0.2;  // share of the projector's height
constexpr double kStroke = 0.3;      // share of the half height
constexpr Rgb kWhite{255, 255, 255}, kDark{0, 0, 0};

/// Strokes as polylines, in a square from -1 to 1.
using Strokes = std::vector<std::vector<Vector2d>>;

Strokes turning_arrow() {
  constexpr int kSteps = 24;
  constexpr double kFrom = -0.2 * std::numbers::pi, kSweep = 1.5 * std::numbers::pi, kRadius = 0.75;
  Strokes strokes(1);
  for (int i = 0; i <= kSteps; ++i) {
    const double turn = kFrom + kSweep * i / kSteps;
    strokes.front().emplace_back(kRadius * std::cos(turn), kRadius * std::sin(turn));
  }
  const Vector2d tip = strokes.front().back();
  strokes.push_back({tip + Vector2d(-0.4, 0.1), tip + Vector2d(0.15, 0), tip + Vector2d(-0.15, 0.5)});
  return strokes;
}

Strokes strokes_of(Sign sign) {
  switch (sign) {
    case Sign::kHold:
      return {{{-0.4, -0.8}, {-0.4, 0.8}}, {{0.4, -0.8}, {0.4, 0.8}}};
    case Sign::kTaken:
      return {{{-0.8, 0.1}, {-0.2, 0.7}, {0.8, -0.7}}};
    default:
      return turning_arrow();
  }
}

double inside(double centre, double half, int length) {
  return std::clamp(centre, half, std::max(half, length - half));
}

Grey8 grey_of(const ColourImage& picture) {
  Grey8 grey(picture.width(), picture.height());
  std::transform(picture.data(), picture.data() + picture.size(), grey.data(),
                 [](const Rgb& pixel) { return pixel[0]; });
  return grey;
}

}  // namespace

Grey8 draw_sign(Sign sign, const ImageSize& projector, const Vector2d& centre_px) {
  ColourImage picture(projector.width_px, projector.height_px, kWhite);
  Canvas canvas(picture);
  const double half = kHalfHeight * projector.height_px;
  const Vector2d centre(inside(centre_px.x(), half, projector.width_px),
                        inside(centre_px.y(), half, projector.height_px));
  for (const std::vector<Vector2d>& stroke : strokes_of(sign)) {
    for (std::size_t i = 1; i < stroke.size(); ++i) {
      canvas.line(centre + half * stroke[i - 1], centre + half * stroke[i], kDark,
                  std::max(1, static_cast<int>(kStroke * half)));
    }
  }
  return grey_of(picture);
}

}  // namespace slsd
