// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/light_levels.hpp"

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <variant>
#include <vector>

namespace slsd {
namespace {

constexpr double kFaintest = 0.05;
constexpr double kBrightest = 0.95;
constexpr double kClipped = 0.985;  // of full: noise and uneven sensor response keep some pixels below

/// The first number in a text; 0 if there is none.
int first_number(std::string_view text) {
  int number = 0;
  const auto first = std::ranges::find_if(text, [](char letter) { return letter >= '0' && letter <= '9'; });
  std::from_chars(text.data() + (first - text.begin()), text.data() + text.size(), number);
  return number;
}

double quantile(std::span<const PatternedTile> tiles, double TileLevels::*level, double share) {
  std::vector<double> values;
  for (const PatternedTile& tile : tiles) values.push_back(tile.levels.*level);
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double median(std::span<const PatternedTile> tiles, double TileLevels::*level) {
  return quantile(tiles, level, 0.5);
}

}  // namespace

LightLevels summarize(std::span<const PatternedTile> tiles, int all, double full) {
  LightLevels levels;
  levels.full = full;
  if (tiles.empty()) return levels;
  const auto clipped =
      std::ranges::count_if(tiles, [&](const PatternedTile& tile) { return tile.levels.lit >= kClipped * full; });
  double clipped_of_lit = 0;
  for (const PatternedTile& tile : tiles) clipped_of_lit += tile.levels.clipped_of_lit;
  levels.dark = median(tiles, &TileLevels::dark);
  levels.lit = median(tiles, &TileLevels::lit);
  levels.lit_brightest = quantile(tiles, &TileLevels::lit, kBrightest);
  levels.lit_faintest = quantile(tiles, &TileLevels::lit, kFaintest);
  levels.clipped_share = static_cast<double>(clipped) / static_cast<double>(tiles.size());
  levels.clipped_of_lit = clipped_of_lit / static_cast<double>(tiles.size());
  levels.edge_px = median(tiles, &TileLevels::edge_px);
  levels.period_px = median(tiles, &TileLevels::period_px);
  levels.patterned_share = static_cast<double>(tiles.size()) / all;
  return levels;
}

LightLevels measure_light(const GreyView& frame, double full) {
  int all = 0;
  const std::vector<PatternedTile> tiles = measure_tiles(frame, full, all);
  return summarize(tiles, all, full);
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

double full_level(std::string_view format, std::span<const GreyView> frames) {
  double full = 0;
  for (const GreyView& frame : frames) full = std::max(full, full_level(format, frame));
  return full;
}

}  // namespace slsd
