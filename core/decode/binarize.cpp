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

constexpr int kRowsAlike = 4;

/// Least and greatest of each column of a band of rows, one row more.
SLSD_CLONES void extend_columns(const std::uint8_t* pixels, int width, std::uint8_t* least, std::uint8_t* greatest) {
  for (int x = 0; x < width; ++x) {
    least[x] = pixels[x] < least[x] ? pixels[x] : least[x];
    greatest[x] = pixels[x] > greatest[x] ? pixels[x] : greatest[x];
  }
}
SLSD_CLONES void extend_columns(const std::uint16_t* pixels, int width, std::uint16_t* least, std::uint16_t* greatest) {
  for (int x = 0; x < width; ++x) {
    least[x] = pixels[x] < least[x] ? pixels[x] : least[x];
    greatest[x] = pixels[x] > greatest[x] ? pixels[x] : greatest[x];
  }
}

SLSD_CLONES void compare_row(const std::uint8_t* pixels, const std::uint8_t* threshold, int width, std::uint8_t* mask) {
  for (int x = 0; x < width; ++x) mask[x] = pixels[x] > threshold[x] ? 255 : 0;
}
SLSD_CLONES void compare_row(const std::uint16_t* pixels, const std::uint16_t* threshold, int width,
                             std::uint8_t* mask) {
  for (int x = 0; x < width; ++x) mask[x] = pixels[x] > threshold[x] ? 255 : 0;
}

/// A straight line of thresholds, rounded down: what is above the whole number is above the threshold.
template <class T>
void fill_ramp(T* threshold, int count, float start, float step) {
  constexpr float kGreatest = static_cast<float>(std::numeric_limits<T>::max());
  for (int i = 0; i < count; ++i)
    threshold[i] = static_cast<T>(std::min(start + step * static_cast<float>(i), kGreatest));
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
  least_.clear();
  greatest_.clear();
  auto& [threshold, least, greatest] = std::get<RowBuffers<T>>(row_buffers_);
  for (int row = 0; row < rows_; ++row) {
    const int top = row * tile, bottom = std::min(top + tile, frame.height);
    least.assign(frame.row(top), frame.row(top) + frame.width);
    greatest = least;
    for (int y = top + 1; y < bottom; ++y) extend_columns(frame.row(y), frame.width, least.data(), greatest.data());
    for (int left = 0; left < frame.width; left += tile) {
      const int right = std::min(left + tile, frame.width);
      least_.push_back(*std::min_element(least.begin() + left, least.begin() + right));
      greatest_.push_back(*std::max_element(greatest.begin() + left, greatest.begin() + right));
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
  auto& threshold = std::get<RowBuffers<T>>(row_buffers_).threshold;
  threshold.resize(static_cast<std::size_t>(frame.width));
  for (int y = 0; y < frame.height; ++y) {
    // Thresholds change little from row to row.
    if (y % kRowsAlike == 0) interpolate_row(y + kRowsAlike / 2, frame.width, threshold.data());
    compare_row(frame.row(y), threshold.data(), frame.width, mask.row(y));
  }
}

/// Tile centres carry the thresholds; between them they are interpolated in both directions.
template <class T>
void Binarizer::interpolate_row(int y, int width, T* threshold) const {
  const float tile = static_cast<float>(options_.tile_px);
  const float v = std::clamp((static_cast<float>(y) + 0.5F) / tile - 0.5F, 0.F, static_cast<float>(rows_ - 1));
  const int r0 = static_cast<int>(v), r1 = std::min(r0 + 1, rows_ - 1);
  const float fraction = v - static_cast<float>(r0);
  const float* upper = threshold_.data() + r0 * columns_;
  const float* lower = threshold_.data() + r1 * columns_;
  const auto at = [&](int column) { return upper[column] + fraction * (lower[column] - upper[column]); };
  float left = at(0);
  int x = 0;
  for (int column = 0; column <= columns_ && x < width; ++column) {
    const float right = at(std::min(column, columns_ - 1));
    const int end = column == columns_ ? width : std::min(column * options_.tile_px + options_.tile_px / 2, width);
    fill_ramp(threshold + x, end - x, left, (right - left) / tile);
    x = end;
    left = right;
  }
}

void Binarizer::binarize(const GreyView& frame, Grey8& mask) {
  std::visit([&](const auto& view) { binarize_as(view, mask); }, frame);
}

}  // namespace slsd
