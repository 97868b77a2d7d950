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

/// The four pixels around a position, and how far it is between them.
struct Between {
  int left, top, right, bottom;
  double across, down;

  Between(int width, int height, double x, double y)
      : left(std::clamp(static_cast<int>(std::floor(x)), 0, width - 1)),
        top(std::clamp(static_cast<int>(std::floor(y)), 0, height - 1)),
        right(std::min(left + 1, width - 1)),
        bottom(std::min(top + 1, height - 1)),
        across(std::clamp(x - left, 0.0, 1.0)),
        down(std::clamp(y - top, 0.0, 1.0)) {}
  [[nodiscard]] double blend(double a, double b, double c, double d) const {
    const double above = a + across * (b - a), below = c + across * (d - c);
    return above + down * (below - above);
  }
};

template <class T>
Sample sample(const ImageView<T>& image, double x, double y) {
  const Between between(image.width, image.height, x, y);
  const double a = image.at(between.left, between.top), b = image.at(between.right, between.top);
  const double c = image.at(between.left, between.bottom), d = image.at(between.right, between.bottom);
  return {between.blend(a, b, c, d), std::max({a, b, c, d})};
}

Sample sample(const GreyView& image, const CloudPoint& point) {
  return std::visit([&](const auto& pixels) { return sample(pixels, point.camera_u, point.camera_v); }, image);
}

std::array<double, 3> sample(const ColourFrame& colours, const CloudPoint& point) {
  const Between between(colours.width(), colours.height(), point.camera_u, point.camera_v);
  std::array<double, 3> levels{};
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] =
        between.blend(colours.at(between.left, between.top)[i], colours.at(between.right, between.top)[i],
                      colours.at(between.left, between.bottom)[i], colours.at(between.right, between.bottom)[i]);
  return levels;
}

std::uint8_t intensity(double share) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(255 * share, 0.0, 255.0)));
}

}  // namespace

Rgb colour_of(const std::array<double, 3>& white, const std::array<double, 3>& dark, const SceneLight& light) {
  Rgb colour{};
  for (std::size_t i = 0; i < colour.size(); ++i)
    colour[i] = intensity(light.gains[i] * (white[i] - dark[i]) / light.colour_full);
  return colour;
}

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
    point.colour = {point.intensity, point.intensity, point.intensity};
    if (light.white_colours == nullptr) continue;
    const auto of_room = light.dark_colours == nullptr ? std::array<double, 3>{} : sample(*light.dark_colours, point);
    point.colour = colour_of(sample(*light.white_colours, point), of_room, light);
  }
  return saturated;
}

}  // namespace slsd
