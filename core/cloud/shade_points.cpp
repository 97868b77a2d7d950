// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/shade_points.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace slsd {
namespace {

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

ColourSample sample(const ColourFrame& colours, const CloudPoint& point) {
  return sample_colours(colours, point.camera_u, point.camera_v);
}

std::uint8_t intensity(double share) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(255 * share, 0.0, 255.0)));
}

}  // namespace

ColourSample sample_colours(const ColourFrame& colours, double u, double v) {
  const Between between(colours.width(), colours.height(), u, v);
  ColourSample sample;
  for (std::size_t i = 0; i < sample.levels.size(); ++i) {
    const double a = colours.at(between.left, between.top)[i], b = colours.at(between.right, between.top)[i];
    const double c = colours.at(between.left, between.bottom)[i], d = colours.at(between.right, between.bottom)[i];
    sample.levels[i] = between.blend(a, b, c, d);
    sample.highest = std::max({sample.highest, a, b, c, d});
  }
  return sample;
}

Rgb colour_of(const ColourSample& white, const ColourSample& dark, const SceneLight& light, bool& saturated) {
  if (white.highest >= kSaturatedShare * light.colour_full) return saturated = true, grey_of(255);
  Rgb colour{};
  for (std::size_t i = 0; i < colour.size(); ++i)
    colour[i] = intensity(light.gains[i] * (white.levels[i] - dark.levels[i]) / light.colour_full);
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
    bool clipped = white.highest >= kSaturatedShare * light.full;
    point.intensity = clipped ? 255 : intensity((white.level - ambient) / light.full);
    point.colour = grey_of(point.intensity);
    if (light.white_colours != nullptr) {
      const ColourSample of_room = light.dark_colours == nullptr ? ColourSample() : sample(*light.dark_colours, point);
      point.colour = colour_of(sample(*light.white_colours, point), of_room, light, clipped);
    }
    saturated += clipped ? 1 : 0;
  }
  return saturated;
}

std::optional<ColourGains> white_balance_of(std::span<const CloudPoint> points, const ColourGains& applied) {
  ColourGains sums{};
  for (const CloudPoint& point : points) {
    if (std::ranges::max(point.colour) == 255) continue;
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += point.colour[i] / applied[i];
  }
  if (std::ranges::any_of(sums, [](double sum) { return sum <= 0; })) return std::nullopt;
  return ColourGains{sums[1] / sums[0], 1, sums[1] / sums[2]};
}

}  // namespace slsd
