// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/light_levels.hpp"

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <utility>
#include <variant>
#include <vector>

#include "core/exposure/tile.hpp"

namespace slsd {
namespace {

constexpr double kFaintest = 0.05;
constexpr double kBrightest = 0.95;
constexpr double kClipped = 0.985;  // of full: noise and uneven sensor response keep some pixels below

std::vector<TileLevels> measure_tiles(const GreyView& frame, double full, int& tiles) {
  std::vector<TileLevels> seen;
  Tile tile;
  const auto [width, height] =
      std::visit([](const auto& image) { return std::pair(image.width, image.height); }, frame);
  for (int top = 0; top + kTilePx <= height; top += kTilePx) {
    for (int left = 0; left + kTilePx <= width; left += kTilePx) {
      ++tiles;
      tile.take(frame, left, top);
      if (const auto levels = tile.measure(full)) seen.push_back(*levels);
    }
  }
  return seen;
}

/// The first number in a text; 0 if there is none.
int first_number(std::string_view text) {
  int number = 0;
  const auto first = std::ranges::find_if(text, [](char letter) { return letter >= '0' && letter <= '9'; });
  std::from_chars(text.data() + (first - text.begin()), text.data() + text.size(), number);
  return number;
}

double quantile(const std::vector<TileLevels>& tiles, double TileLevels::*level, double share) {
  std::vector<double> values;
  for (const TileLevels& tile : tiles) values.push_back(tile.*level);
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double median(const std::vector<TileLevels>& tiles, double TileLevels::*level) {
  return quantile(tiles, level, 0.5);
}

}  // namespace

LightLevels measure_light(const GreyView& frame, double full) {
  LightLevels levels;
  levels.full = full;
  int tiles = 0;
  const std::vector<TileLevels> seen = measure_tiles(frame, full, tiles);
  if (seen.empty()) return levels;
  const auto clipped = std::ranges::count_if(seen, [&](const TileLevels& tile) { return tile.lit >= kClipped * full; });
  levels.dark = median(seen, &TileLevels::dark);
  levels.lit = median(seen, &TileLevels::lit);
  levels.lit_brightest = quantile(seen, &TileLevels::lit, kBrightest);
  levels.lit_faintest = quantile(seen, &TileLevels::lit, kFaintest);
  levels.clipped_share = static_cast<double>(clipped) / static_cast<double>(seen.size());
  levels.edge_px = median(seen, &TileLevels::edge_px);
  levels.period_px = median(seen, &TileLevels::period_px);
  levels.patterned_share = static_cast<double>(seen.size()) / tiles;
  return levels;
}

double guess_full_level(const GreyView& frame) {
  const auto* wide = std::get_if<ImageView<std::uint16_t>>(&frame);
  if (wide == nullptr) return 255;
  std::uint16_t highest = 0;
  for (int y = 0; y < wide->height; ++y) {
    // The compiler does not vectorise std::max_element, and this runs for every frame of more than 8 bits.
    const std::uint16_t* row = wide->row(y);
    for (int x = 0; x < wide->width; ++x) highest = std::max(highest, row[x]);
  }
  for (const int full : {1023, 4095, 16383}) {
    if (highest <= full) return full;
  }
  return 65535;
}

double HeldFullLevel::of(const GreyView& frame) {
  const double guessed = guess_full_level(frame);
  if (frame.index() == 0) return guessed;
  return greatest_ = std::max(greatest_, guessed);
}

double full_level(std::string_view format, const GreyView& frame) {
  if (frame.index() == 0) return 255;
  const double guessed = guess_full_level(frame);
  const int bits = first_number(format);
  return bits == 10 || bits == 12 || bits == 14 ? std::max<double>((1 << bits) - 1, guessed) : guessed;
}

}  // namespace slsd
