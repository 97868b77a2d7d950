// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/tile.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace slsd {
namespace {

constexpr double kDarkShare = 0.05;
constexpr double kLitShare = 0.95;
constexpr double kContrastMin = 0.015;  // of full: the decoder does not accept fainter symbols either
constexpr double kPeriodMinPx = 6.0;    // noise alone crosses its mean about every fourth pixel
constexpr double kPeriodMaxPx = 0.75 * kTilePx;
constexpr double kSteepShare = 0.99;

double quantile_of(std::vector<float>& values, double share) {
  if (values.empty()) return 0;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

void Tile::take(const GreyView& frame, int left, int top) {
  pixels_.resize(static_cast<std::size_t>(kTilePx) * kTilePx);
  std::visit(
      [&](const auto& image) {
        for (int y = 0; y < kTilePx; ++y) {
          std::copy_n(image.row(top + y) + left, kTilePx, pixels_.begin() + static_cast<std::ptrdiff_t>(y) * kTilePx);
        }
      },
      frame);
}

double Tile::quantile(double share) {
  room_ = pixels_;
  return quantile_of(room_, share);
}

double Tile::steepest() {
  room_.clear();
  for (int y = 1; y + 1 < kTilePx; ++y) {
    for (int x = 1; x + 1 < kTilePx; ++x) {
      const float right = at(x + 1, y) - at(x - 1, y);
      const float down = at(x, y + 1) - at(x, y - 1);
      room_.push_back(0.5F * std::max(std::abs(right), std::abs(down)));
    }
  }
  return quantile_of(room_, kSteepShare);
}

double Tile::period_px(double middle) const {
  int rises = 0;
  for (int y = 0; y < kTilePx; ++y) {
    for (int x = 1; x < kTilePx; ++x) rises += at(x - 1, y) < middle && at(x, y) >= middle ? 1 : 0;
  }
  return rises == 0 ? kTilePx : static_cast<double>(kTilePx) * kTilePx / rises;
}

double Tile::clipped_of_lit(double middle, double full) const {
  const auto lit = std::ranges::count_if(pixels_, [&](float level) { return level > middle; });
  const auto clipped = std::ranges::count_if(pixels_, [&](float level) { return level >= full; });
  return lit == 0 ? 0 : static_cast<double>(clipped) / static_cast<double>(lit);
}

std::optional<TileLevels> Tile::measure(double full) {
  TileLevels levels;
  levels.dark = quantile(kDarkShare);
  levels.lit = quantile(kLitShare);
  const double contrast = levels.lit - levels.dark;
  const double middle = 0.5 * (levels.lit + levels.dark);
  if (contrast < kContrastMin * full) return std::nullopt;
  levels.period_px = period_px(middle);
  if (levels.period_px < kPeriodMinPx || levels.period_px > kPeriodMaxPx) return std::nullopt;
  // A step blurred by a Gaussian of sigma has its steepest slope, 1 / (sqrt(2 pi) sigma) of its height per pixel, at
  // the middle.
  levels.edge_px = 0.399 * contrast / steepest();
  levels.clipped_of_lit = clipped_of_lit(middle, full);
  return levels;
}

std::vector<PatternedTile> measure_tiles(const GreyView& frame, double full, int& tiles) {
  std::vector<PatternedTile> seen;
  Tile tile;
  const auto [width, height] = size_of(frame);
  tiles = 0;
  for (int top = 0; top + kTilePx <= height; top += kTilePx) {
    for (int left = 0; left + kTilePx <= width; left += kTilePx) {
      ++tiles;
      tile.take(frame, left, top);
      if (const auto levels = tile.measure(full)) seen.push_back({left, top, *levels});
    }
  }
  return seen;
}

}  // namespace slsd
