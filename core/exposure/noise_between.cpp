// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/noise_between.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <type_traits>
#include <variant>

#include "core/exposure/tile.hpp"

namespace slsd {
namespace {

constexpr int kLevels = 32;
constexpr int kSlopes = 256;
constexpr double kUnclipped = 0.97;  // of full: brighter pixels lose a part of their noise
constexpr double kFlattestShare = 0.25;
constexpr double kOutlier = 10;  // in standard deviations of a usual pixel; bright ones have twice the noise
constexpr std::int64_t kPixelsMin = 400;
constexpr double kOfRounding = 1 / 12.0;
constexpr double kNoiseMin = 0.2;  // variance: with less, rounding decides what neighbours have in common

struct Sums {
  std::int64_t pixels = 0;
  double level = 0, squares = 0, products = 0;
};

/// The slopes of the flattest pixels of each level.
using Slopes = std::array<int, kLevels>;

template <class T>
class BetweenFrames {
 public:
  BetweenFrames(const ImageView<T>& first, const ImageView<T>& second, const FrameChange& change, double full)
      : first_(first), second_(second), change_(change), full_(full), most_(kOutlier * change.noise + 2) {}

  [[nodiscard]] NoiseBetween measure() const {
    const Slopes flattest = find_flattest();
    std::array<Sums, kLevels> sums{};
    for (const PixelPlace& tile : change_.still) add_tile(tile, flattest, sums);
    NoiseBetween noise;
    double squares = 0, products = 0, pixels = 0;
    for (const Sums& at : sums) {
      if (at.pixels < kPixelsMin) continue;
      const auto count = static_cast<double>(at.pixels);
      noise.levels.push_back({at.level / count, std::max(0.0, at.squares / count / 2 - kOfRounding), at.pixels});
      squares += at.squares, products += at.products, pixels += count;
    }
    const double of_noise = squares - 2 * kOfRounding * pixels;
    if (pixels > 0 && of_noise > 2 * kNoiseMin * pixels) noise.neighbours = std::clamp(products / of_noise, -1.0, 1.0);
    return noise;
  }

 private:
  [[nodiscard]] double sum(int x, int y) const { return static_cast<double>(first_.at(x, y)) + second_.at(x, y); }
  [[nodiscard]] double difference(int x, int y) const { return second_.at(x, y) - change_.brighter * first_.at(x, y); }
  /// Negative if the pixel or its neighbour to the right or below is nearly saturated.
  [[nodiscard]] int level_of(int x, int y) const {
    const double brightest = std::max({sum(x, y), sum(x + 1, y), sum(x, y + 1)}) / 2;
    return brightest >= kUnclipped * full_ ? -1 : static_cast<int>(kLevels * sum(x, y) / 2 / full_);
  }
  [[nodiscard]] int slope_of(int x, int y) const {
    const double slope = std::abs(sum(x + 1, y) - sum(x - 1, y)) + std::abs(sum(x, y + 1) - sum(x, y - 1));
    const double unit = std::is_same_v<T, std::uint8_t> ? 1 : full_ / 1024;
    return static_cast<int>(std::min<double>(slope / unit, kSlopes - 1));
  }

  template <class Visit>
  void visit(const PixelPlace& tile, Visit&& each) const {
    for (int y = tile.y + 1; y + 1 < tile.y + kTilePx; ++y) {
      for (int x = tile.x + 1; x + 1 < tile.x + kTilePx; ++x) {
        if (const int level = level_of(x, y); level >= 0) each(x, y, level);
      }
    }
  }

  [[nodiscard]] Slopes find_flattest() const {
    std::array<std::array<std::int64_t, kSlopes>, kLevels> histograms{};
    std::array<std::int64_t, kLevels> counts{};
    for (const PixelPlace& tile : change_.still) {
      visit(tile, [&](int x, int y, int level) { ++histograms[level][slope_of(x, y)], ++counts[level]; });
    }
    Slopes flattest{};
    for (int level = 0; level < kLevels; ++level) {
      const auto wanted = static_cast<std::int64_t>(kFlattestShare * static_cast<double>(counts[level]));
      std::int64_t below = histograms[level][0];
      while (below < wanted && flattest[level] + 1 < kSlopes) below += histograms[level][++flattest[level]];
    }
    return flattest;
  }

  /// The mean change of each of the tile's rows is flicker, not noise.
  void add_tile(const PixelPlace& tile, const Slopes& flattest, std::array<Sums, kLevels>& sums) const {
    std::array<double, kTilePx> means{};
    for (int y = 0; y < kTilePx; ++y) {
      for (int x = 0; x < kTilePx; ++x) means[y] += difference(tile.x + x, tile.y + y) / kTilePx;
    }
    visit(tile, [&](int x, int y, int level) {
      if (slope_of(x, y) > flattest[level]) return;
      const double mean = means[y - tile.y], here = difference(x, y) - mean;
      const double right = difference(x + 1, y) - mean, below = difference(x, y + 1) - means[y + 1 - tile.y];
      if (std::max({std::abs(here), std::abs(right), std::abs(below)}) > most_) return;
      Sums& at = sums[level];
      ++at.pixels, at.level += sum(x, y) / 2, at.squares += here * here, at.products += here * (right + below) / 2;
    });
  }

  const ImageView<T>& first_;
  const ImageView<T>& second_;
  const FrameChange& change_;
  double full_;
  double most_;  ///< larger differences are motion
};

}  // namespace

NoiseBetween noise_between(const GreyView& first, const GreyView& second, const FrameChange& change, double full) {
  return std::visit(
      [&]<class A, class B>(const ImageView<A>& a, const ImageView<B>& b) {
        if constexpr (std::is_same_v<A, B>) {
          if (a.width == b.width && a.height == b.height) return BetweenFrames<A>(a, b, change, full).measure();
        }
        return NoiseBetween{};
      },
      first, second);
}

}  // namespace slsd
