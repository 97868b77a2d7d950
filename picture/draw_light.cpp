// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/draw_light.hpp"

#include <algorithm>
#include <vector>

#include "picture/canvas.hpp"
#include "picture/dimmed_frame.hpp"
#include "picture/legend.hpp"

namespace slsd {
namespace {

constexpr int kWidePx = 800;  // of one copy, or little more
constexpr double kTint = 0.55;
constexpr double kFooterLines = 6;  // in letter heights
constexpr Rgb kTitleInk{222, 228, 238};

/// A measure of a tile, with the limits and the names of its four colours.
struct Measure {
  const char* title;
  double (*of)(const TileLevels& levels);
  std::array<double, 3> limits;
  std::array<const char*, 4> names;
};

const std::array<Measure, 3> kMeasures{{{"clipped: share of the symbols' pixels",
                                         [](const TileLevels& levels) { return levels.clipped_of_lit; },
                                         {0.005, 0.05, 0.3},
                                         {"none", "to 5 %", "to 30 %", "more"}},
                                        {"room light: times the pattern's",
                                         [](const TileLevels& levels) { return levels.room_light(); },
                                         {0.5, 1, 2},
                                         {"to 0.5", "to 1", "to 2", "more"}},
                                        {"blur: edge to period",
                                         [](const TileLevels& levels) { return levels.edge_px / levels.period_px; },
                                         {0.05, 0.075, 0.1},
                                         {"to 0.05", "to 0.075", "to 0.1", "more"}}}};

Rgb light_colour(const Measure& measure, const TileLevels& levels) {
  const auto limit = std::ranges::lower_bound(measure.limits, measure.of(levels));
  return kLightColours[static_cast<std::size_t>(limit - measure.limits.begin())];
}

void tint(ColourImage& picture, const PatternedTile& tile, Rgb colour) {
  for (int y = tile.top; y < tile.top + kTilePx; ++y) {
    for (int x = tile.left; x < tile.left + kTilePx; ++x) picture.at(x, y) = mix(picture.at(x, y), colour, kTint);
  }
}

/// The means of squares of pixels.
ColourImage shrunk(const ColourImage& picture, int step, int footer_px, Rgb footer) {
  ColourImage small(picture.width() / step, picture.height() / step + footer_px, footer);
  for (int y = 0; y < picture.height() / step; ++y) {
    for (int x = 0; x < small.width(); ++x) {
      std::array<int, 3> sums{};
      for (int i = 0; i < step * step; ++i) {
        const Rgb& pixel = picture.at(x * step + i % step, y * step + i / step);
        for (std::size_t c = 0; c < 3; ++c) sums[c] += pixel[c];
      }
      for (std::size_t c = 0; c < 3; ++c) small.at(x, y)[c] = static_cast<std::uint8_t>(sums[c] / (step * step));
    }
  }
  return small;
}

ColourImage draw_measure(const ColourImage& dimmed, std::span<const PatternedTile> tiles, const Measure& measure) {
  constexpr Rgb kFooterInk{24, 27, 34};
  ColourImage tinted = dimmed;
  for (const PatternedTile& tile : tiles) tint(tinted, tile, light_colour(measure, tile.levels));
  const int step = std::max(1, dimmed.width() / kWidePx);
  const double text_px = std::max(8.0, dimmed.width() / step / 60.0);
  ColourImage picture = shrunk(tinted, step, static_cast<int>(kFooterLines * text_px), kFooterInk);
  const int top = dimmed.height() / step;
  Canvas(picture).text({text_px, top + 2 * text_px}, measure.title, text_px, kTitleInk);
  Legend legend(picture, top + static_cast<int>(2.2 * text_px), text_px);
  for (std::size_t i = 0; i < kLightColours.size(); ++i) legend.disc(kLightColours[i], measure.names[i]);
  return picture;
}

}  // namespace

ColourImage draw_light(const GreyView& frame, std::span<const PatternedTile> tiles) {
  const ColourImage dimmed = dimmed_frame(frame, 1, 0);
  std::vector<ColourImage> copies;
  for (const Measure& measure : kMeasures) copies.push_back(draw_measure(dimmed, tiles, measure));
  const int width = copies.front().width(), height = copies.front().height();
  ColourImage picture(3 * width, height);
  for (int y = 0; y < height; ++y) {
    for (int i = 0; i < 3; ++i) std::copy_n(copies[i].row(y), width, picture.row(y) + i * width);
  }
  return picture;
}

}  // namespace slsd
