// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/view_demands.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace slsd {
namespace {

constexpr std::size_t kCornersMin = 8;
constexpr std::size_t kSymbolsMin = 30;
/// Share of the board's saturated pixels above which its edges and the symbols appear displaced.
constexpr double kClippedMax = 0.25;
constexpr std::ptrdiff_t kLinesMin = 2;  // rows, and columns, with two or more corners
/// Limits of blur as a factor and in px: both must be exceeded.
constexpr double kBlurFactor = 1.5, kBlurMorePx = 0.35;

/// Counts the lines along one axis of the board that have two or more corners.
std::ptrdiff_t lines(const PoseView& view, Eigen::Index axis) {
  constexpr double kSameMm = 1e-3;
  std::map<long, int> counts;
  for (const BoardPoint& corner : view.corners) ++counts[std::lround(corner.board_mm(axis) / kSameMm)];
  return std::ranges::count_if(counts, [](const auto& line) { return line.second > 1; });
}

}  // namespace

std::string lack_of_corners(const PoseView& view) {
  if (view.corners.size() < kCornersMin) {
    return fmt::format(
        "only {} of the board's corners were found, but {} are needed; bring more of the board into the picture",
        view.corners.size(), kCornersMin);
  }
  if (std::min(lines(view, 0), lines(view, 1)) < kLinesMin) {
    return fmt::format(
        "the {} corners found lie along one line of the board, but must fill two rows and two columns; bring more of "
        "the board into the picture",
        view.corners.size());
  }
  return {};
}

std::string lack_of_symbols(std::size_t symbols) {
  if (symbols >= kSymbolsMin) return {};
  return fmt::format(
      "only {} of the pattern's symbols were read on the board, but {} are needed; hold it in the projector's light, "
      "in focus, and shade other light",
      symbols, kSymbolsMin);
}

std::string excess_of_light(double clipped_share) {
  if (clipped_share <= kClippedMax) return {};
  return fmt::format(
      "clipped: {:.0f} % of the board's pixels are at full level; expose less, or turn a reflection away",
      100 * clipped_share);
}

bool is_blurred(double blur_px, double usual_px) {
  return usual_px > 0 && blur_px > kBlurFactor * usual_px && blur_px > usual_px + kBlurMorePx;
}

}  // namespace slsd
