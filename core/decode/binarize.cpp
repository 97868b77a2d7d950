// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/binarize.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "core/decode/clones.hpp"

namespace slsd {
namespace {

/// Least and greatest of one row of a tile.
template <class T>
inline void extend_extremes(const T* pixels, int count, int& least, int& greatest) {
  T low = pixels[0], high = pixels[0];
  for (int x = 1; x < count; ++x) {
    low = std::min(low, pixels[x]);
    high = std::max(high, pixels[x]);
  }
  least = std::min<int>(least, low);
  greatest = std::max<int>(greatest, high);
}

SLSD_CLONES void compare_row(const std::uint8_t* pixels, const float* threshold, int width, std::uint8_t* mask) {
  for (int x = 0; x < width; ++x) mask[x] = static_cast<float>(pixels[x]) > threshold[x] ? 255 : 0;
}
SLSD_CLONES void compare_row(const std::uint16_t* pixels, const float* threshold, int width, std::uint8_t* mask) {
  for (int x = 0; x < width; ++x) mask[x] = static_cast<float>(pixels[x]) > threshold[x] ? 255 : 0;
}

/// Standard deviation of the noise, from the median second difference along the rows of a sample of pixels: edges are
/// too few to move the median.
template <class T>
float noise_sigma(const ImageView<T>& frame) {
  constexpr int kStep = 7, kBins = 1024;
  std::array<int, kBins> histogram{};
  int count = 0;
  for (int y = kStep; y < frame.height; y += kStep) {
    const T* row = frame.row(y);
    for (int x = 1; x + 1 < frame.width; x += kStep, ++count) {
      ++histogram[std::min(std::abs(row[x - 1] - 2 * row[x] + row[x + 1]) / (sizeof(T) == 1 ? 1 : 64), kBins - 1)];
    }
  }
  int bin = 0;
  for (int below = histogram[0]; 2 * below < count; below += histogram[++bin]) {
  }
  constexpr float kMedianOfDifference = 0.6745F * 2.4495F;  // of |a - 2b + c|, sigma 1
  return static_cast<float>(bin) * (sizeof(T) == 1 ? 1.F : 64.F) / kMedianOfDifference;
}

/// Mean of the 3x3 neighbours of a tile, fewer at the border.
float mean_around(const std::vector<float>& tiles, int columns, int rows, int column, int row) {
  float sum = 0;
  int count = 0;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c, ++count)
      sum += tiles[r * columns + c];
  }
  return sum / static_cast<float>(count);
}

}  // namespace

template <class T>
void Binarizer::find_extremes(const ImageView<T>& frame) {
  const int tile = options_.tile_px;
  columns_ = (frame.width + tile - 1) / tile;
  rows_ = (frame.height + tile - 1) / tile;
  const auto count = static_cast<std::size_t>(columns_) * rows_;
  least_.assign(count, std::numeric_limits<int>::max());
  greatest_.assign(count, 0);
  for (int y = 0; y < frame.height; ++y) {
    const auto* pixels = frame.row(y);
    int* least = least_.data() + (y / tile) * columns_;
    int* greatest = greatest_.data() + (y / tile) * columns_;
    for (int c = 0; c < columns_; ++c) {
      extend_extremes(pixels + c * tile, std::min(tile, frame.width - c * tile), least[c], greatest[c]);
    }
  }
}

void Binarizer::set_thresholds(int contrast_min, int nothing_lit) {
  midway_.resize(least_.size());
  threshold_.resize(least_.size());
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      int low = std::numeric_limits<int>::max(), high = 0;
      for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
          low = std::min(low, least_[r * columns_ + c]);
          high = std::max(high, greatest_[r * columns_ + c]);
        }
      }
      midway_[row * columns_ + column] =
          high - low < contrast_min ? static_cast<float>(high + nothing_lit)
                                    : static_cast<float>(low) + options_.level * static_cast<float>(high - low);
    }
  }
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      threshold_[row * columns_ + column] = mean_around(midway_, columns_, rows_, column, row);
    }
  }
}

template <class T>
void Binarizer::binarize_as(const ImageView<T>& frame, Grey8& mask) {
  if (mask.width() != frame.width || mask.height() != frame.height) mask = Grey8(frame.width, frame.height);
  const int floor = sizeof(T) == 1 ? options_.contrast_min : options_.contrast_min * 257;
  const int contrast_min = std::max(floor, static_cast<int>(options_.contrast_min_sigma * noise_sigma(frame)));
  find_extremes(frame);
  set_thresholds(contrast_min, contrast_min);
  row_threshold_.resize(static_cast<std::size_t>(frame.width));

  const float tile = static_cast<float>(options_.tile_px);
  for (int y = 0; y < frame.height; ++y) {
    // Tile centres carry the thresholds; between them they are interpolated in both directions.
    const float v = std::clamp((static_cast<float>(y) + 0.5F) / tile - 0.5F, 0.F, static_cast<float>(rows_ - 1));
    const int r0 = static_cast<int>(v), r1 = std::min(r0 + 1, rows_ - 1);
    const float fv = v - static_cast<float>(r0);
    const float* upper = threshold_.data() + r0 * columns_;
    const float* lower = threshold_.data() + r1 * columns_;
    const int half = options_.tile_px / 2;
    float left = upper[0] + fv * (lower[0] - upper[0]);
    int x = 0;
    for (int c = 0; c <= columns_; ++c) {
      const int next = std::min(c, columns_ - 1);
      const float right = upper[next] + fv * (lower[next] - upper[next]);
      const int end = std::min(c * options_.tile_px + half, frame.width);
      const float step = (right - left) / tile;
      for (int i = 0; x < end; ++x, ++i) row_threshold_[x] = left + step * static_cast<float>(i);
      left = right;
    }
    for (; x < frame.width; ++x) row_threshold_[x] = left;
    compare_row(frame.row(y), row_threshold_.data(), frame.width, mask.row(y));
  }
}

void Binarizer::binarize(const GreyView& frame, Grey8& mask) {
  std::visit([&](const auto& view) { binarize_as(view, mask); }, frame);
}

}  // namespace slsd
