// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_change.hpp"

#include <algorithm>
#include <cmath>
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
constexpr double kMovedLevels = 2.0;  // of 255: changes by rounding or a codec are no motion

template <class T>
double sum_of(const ImageView<T>& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) sum += image.at(x, y);
  }
  return sum;
}

// Mean magnitude of the change in a tile, without the whole frame's change of brightness.
template <class T>
double change_in(const ImageView<T>& first, const ImageView<T>& second, double brighter, int left, int top) {
  double sum = 0;
  for (int y = top; y < top + kTilePx; ++y) {
    for (int x = left; x < left + kTilePx; ++x) sum += std::abs(second.at(x, y) - brighter * first.at(x, y));
  }
  return sum / (kTilePx * kTilePx);
}

template <class T>
FrameChange compare(const ImageView<T>& first, const ImageView<T>& second) {
  FrameChange change;
  const double light = sum_of(first);
  if (light > 0 && sum_of(second) > 0) change.brighter = sum_of(second) / light;
  std::vector<double> changes;
  for (int top = 0; top + kTilePx <= first.height; top += kTilePx) {
    for (int left = 0; left + kTilePx <= first.width; left += kTilePx) {
      changes.push_back(change_in(first, second, change.brighter, left, top));
    }
  }
  if (changes.empty()) return change;
  const double still = median_in_place(changes);
  const double level = sizeof(T) == 1 ? kMovedLevels : 0;
  const auto moved = std::ranges::count_if(changes, [&](double c) { return c > kMovedNoises * still + level; });
  change.noise = still / kMeanDifference;
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
