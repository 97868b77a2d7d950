// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/shade_points.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace slsd {
namespace {

constexpr double kSaturated = 0.985;  // of full: noise and uneven sensor response keep some pixels below

/// Levels of an image at a position between four pixels.
struct Sample {
  double level = 0;    ///< interpolated
  double highest = 0;  ///< highest of the four
};

template <class T>
Sample sample(const ImageView<T>& image, double x, double y) {
  const int left = std::clamp(static_cast<int>(std::floor(x)), 0, image.width - 1);
  const int top = std::clamp(static_cast<int>(std::floor(y)), 0, image.height - 1);
  const int right = std::min(left + 1, image.width - 1);
  const int bottom = std::min(top + 1, image.height - 1);
  const double across = std::clamp(x - left, 0.0, 1.0), down = std::clamp(y - top, 0.0, 1.0);
  const double a = image.at(left, top), b = image.at(right, top);
  const double c = image.at(left, bottom), d = image.at(right, bottom);
  const double above = a + across * (b - a), below = c + across * (d - c);
  return {above + down * (below - above), std::max({a, b, c, d})};
}

Sample sample(const GreyView& image, const CloudPoint& point) {
  return std::visit([&](const auto& pixels) { return sample(pixels, point.camera_u, point.camera_v); }, image);
}

std::uint8_t intensity(double share) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(255 * share, 0.0, 255.0)));
}

}  // namespace

std::size_t shade_points(std::span<CloudPoint> points, const SceneLight& light) {
  std::size_t saturated = 0;
  for (CloudPoint& point : points) {
    const double ambient = light.dark ? sample(*light.dark, point).level : 0;
    if (!light.white) {
      point.intensity = intensity(point.intensity / 255.0 - ambient / light.full);
      continue;
    }
    const Sample white = sample(*light.white, point);
    const bool clipped = white.highest >= kSaturated * light.full;
    point.intensity = clipped ? 255 : intensity((white.level - ambient) / light.full);
    saturated += clipped ? 1 : 0;
  }
  return saturated;
}

}  // namespace slsd
