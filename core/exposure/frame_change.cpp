// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/exposure/tile.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

// Mean magnitude of the difference of two normally distributed numbers, in standard deviations of one: 2 / sqrt(pi).
constexpr double kMeanDifference = 1.128;
constexpr double kMovedNoises = 3.0;
constexpr double kStillNoises = 2.0;  // brighter tiles have more noise than the usual one
constexpr double kMovedLevels = 2.0;  // of 255: changes by rounding or a codec are no motion

template <class T>
double sum_of(const ImageView<T>& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) sum += image.at(x, y);
  }
  return sum;
}

// Median relative change of a row, without the whole frame's. Lamps on the mains give bands in a rolling shutter.
template <class T>
double bands_between(const ImageView<T>& first, const ImageView<T>& second, double brighter) {
  std::vector<double> changes;
  for (int y = 0; y < first.height; ++y) {
    const double before = brighter * std::accumulate(first.row(y), first.row(y) + first.width, 0.0);
    const double after = std::accumulate(second.row(y), second.row(y) + second.width, 0.0);
    if (before > 0) changes.push_back(std::abs(after / before - 1));
  }
  return median_in_place(changes);
}

// Mean magnitude of the change in a tile, without flicker: the frame's change of brightness, and that of each row.
template <class T>
double change_in(const ImageView<T>& first, const ImageView<T>& second, double brighter, int left, int top) {
  double sum = 0;
  std::array<double, kTilePx> row{};
  for (int y = top; y < top + kTilePx; ++y) {
    for (int x = 0; x < kTilePx; ++x) row[x] = second.at(left + x, y) - brighter * first.at(left + x, y);
    const double mean = std::accumulate(row.begin(), row.end(), 0.0) / kTilePx;
    for (const double change : row) sum += std::abs(change - mean);
  }
  return sum / (kTilePx * kTilePx);
}

template <class T>
FrameChange compare(const ImageView<T>& first, const ImageView<T>& second) {
  FrameChange change;
  const double light = sum_of(first);
  if (light > 0 && sum_of(second) > 0) change.brighter = sum_of(second) / light;
  change.bands = bands_between(first, second, change.brighter);
  std::vector<double> changes;
  std::vector<PixelPlace> tiles;
  for (int top = 0; top + kTilePx <= first.height; top += kTilePx) {
    for (int left = 0; left + kTilePx <= first.width; left += kTilePx) {
      changes.push_back(change_in(first, second, change.brighter, left, top));
      tiles.push_back({left, top});
    }
  }
  if (changes.empty()) return change;
  const double usual = median_of(changes);
  const double level = sizeof(T) == 1 ? kMovedLevels : 0;
  const auto moved = std::ranges::count_if(changes, [&](double c) { return c > kMovedNoises * usual + level; });
  for (std::size_t i = 0; i < tiles.size(); ++i)
    if (changes[i] <= kStillNoises * usual) change.still.push_back(tiles[i]);
  change.noise = usual / kMeanDifference;
  change.moved_share = static_cast<double>(moved) / static_cast<double>(changes.size());
  return change;
}

}  // namespace

FrameChange compare_frames(const GreyView& first, const GreyView& second) {
  return std::visit(
      []<class A, class B>(const ImageView<A>& a, const ImageView<B>& b) {
        if constexpr (std::is_same_v<A, B>) {
          if (a.width == b.width && a.height == b.height) return compare(a, b);
        }
        return FrameChange{};
      },
      first, second);
}

}  // namespace slsd
