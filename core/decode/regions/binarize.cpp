// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/binarize.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "core/clones.hpp"
#include "core/decode/regions/slide.hpp"
#include "core/geometry/robust.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

constexpr int kRowsAlike = 4;

/// Shares of saturated pixels around a tile from which the threshold rises, and at which it is highest. Symbols cover
/// more than a third; a lamp or a glint covers less than the first.
constexpr float kSaturatedFirst = 0.05F, kSaturatedMost = 0.2F;
/// Place of the highest threshold between dark and the full level. The light of saturated symbols is unknown, but the
/// middle of their edges lies this high or higher.
constexpr float kSaturatedLevel = 0.95F;

/// Minimum and maximum of each column over a band of rows, updated with one more row.
template <class T>
inline __attribute__((always_inline)) void extend_columns(const T* pixels, int width, T* least, T* greatest) {
  for (int x = 0; x < width; ++x) {
    least[x] = pixels[x] < least[x] ? pixels[x] : least[x];
    greatest[x] = pixels[x] > greatest[x] ? pixels[x] : greatest[x];
  }
}

template <class T>
inline __attribute__((always_inline)) void compare_row(const T* pixels, const T* threshold, int width,
                                                       std::uint64_t* lit) {
  alignas(Lanes) std::uint8_t bytes[Mask::kWordPx];
  int x = 0;
  for (; x + Mask::kWordPx <= width; x += Mask::kWordPx) {
    for (int i = 0; i < Mask::kWordPx; ++i) bytes[i] = pixels[x + i] > threshold[x + i] ? 255 : 0;
    *lit++ = top_bits(bytes);
  }
  if (x == width) return;
  std::fill_n(bytes, Mask::kWordPx, 0);
  for (int i = 0; x + i < width; ++i) bytes[i] = pixels[x + i] > threshold[x + i] ? 255 : 0;
  *lit = top_bits(bytes);
}

template <class T>
inline __attribute__((always_inline)) void slide_extremes(T* least, T* greatest, int count, int length) {
  slide_least(least, count, length);
  slide_greatest(greatest, count, length);
}

template <class T>
inline __attribute__((always_inline)) T difference(T a, T b) {
  return static_cast<T>((a > b ? a : b) - (a > b ? b : a));
}

/// The greatest difference between pixels two apart, across or down, for each of `count` pixels; the row's first and
/// last pixels have none.
/// @param count  number of requested pixels; beyond the row there is no difference either
template <class T>
inline __attribute__((always_inline)) void find_steepest(const T* above, const T* row, const T* below, int width,
                                                         int length, int count, T* steepest) {
  for (int x = 1; x < width - 1; ++x) {
    const T across = difference(row[x + 1], row[x - 1]), down = difference(below[x], above[x]);
    steepest[x] = across > down ? across : down;
  }
  steepest[0] = 0;
  for (int x = width > 1 ? width - 1 : 1; x < count; ++x) steepest[x] = 0;
  slide_greatest(steepest, count, length);
}

/// Binary fraction digits of a threshold. A line may continue for kLanes pixels beyond a tile and stay within 31 bits.
template <class T>
constexpr int kFractionBits = sizeof(T) == 1 ? 20 : 12;

inline __attribute__((always_inline)) void store_pixels(const IntLanes& lanes, std::uint8_t* pixels) {
  using Bytes [[gnu::vector_size(sizeof(IntLanes))]] = std::uint8_t;
  const auto bytes = reinterpret_cast<Bytes>(lanes);
  const auto lowest = __builtin_shufflevector(bytes, bytes, 0, 4, 8, 12, 16, 20, 24, 28);
  std::memcpy(pixels, &lowest, sizeof lowest);
}
inline __attribute__((always_inline)) void store_pixels(const IntLanes& lanes, std::uint16_t* pixels) {
  using Words [[gnu::vector_size(sizeof(IntLanes))]] = std::uint16_t;
  const auto words = reinterpret_cast<Words>(lanes);
  const auto lowest = __builtin_shufflevector(words, words, 0, 2, 4, 6, 8, 10, 12, 14);
  std::memcpy(pixels, &lowest, sizeof lowest);
}

struct ThresholdLine {
  const int *at_centre, *step;  // one for each tile
  int tiles, tile_px;
};

/// Interpolates from the centre of the first tile to that of the last, kLanes pixels at a time. The last pixels may lie
/// beyond a tile's end; the next tile overwrites them.
template <class T>
inline __attribute__((always_inline)) void draw_line(const ThresholdLine& line, T* threshold) {
  for (int tile = 0; tile + 1 < line.tiles; ++tile) {
    const int step = line.step[tile];
    IntLanes value = line.at_centre[tile] + kIntLane * step;
    for (int x = 0; x < line.tile_px; x += kLanes, value += kLanes * step)
      store_pixels(value >> kFractionBits<T>, threshold + tile * line.tile_px + x);
  }
}

/// Combines each tile with its eight neighbours. The tiles have a border one tile wide, whose values are ignored.
template <class Operation>
void combine_3x3(const std::vector<float>& tiles, int stride, Operation operation, std::vector<float>& across,
                 std::vector<float>& combined) {
  const int count = static_cast<int>(tiles.size());
  across.resize(tiles.size());
  combined.resize(tiles.size());
  for (int i = 1; i + 1 < count; ++i) across[i] = operation(operation(tiles[i - 1], tiles[i]), tiles[i + 1]);
  for (int i = stride; i + stride < count; ++i)
    combined[i] = operation(operation(across[i - stride], across[i]), across[i + stride]);
}

}  // namespace

/// Finds the extremes of one row of tiles.
template <class T>
void Binarizer::find_extremes(const ImageView<T>& frame, int row, RowBuffers<T>& buffers) {
  const int tile = options_.tile_px;
  auto& [threshold, least, greatest] = buffers;
  const int top = row * tile, bottom = std::min(top + tile, frame.height);
  least.assign(frame.row(top), frame.row(top) + frame.width);
  greatest = least;
  for (int y = top + 1; y < bottom; ++y)
    Cloned<extend_columns<T>>::call(frame.row(y), frame.width, least.data(), greatest.data());
  // The last tile may reach beyond the frame.
  least.resize(static_cast<std::size_t>(columns_) * tile, std::numeric_limits<T>::max());
  greatest.resize(least.size(), 0);
  Cloned<slide_extremes<T>>::call(least.data(), greatest.data(), static_cast<int>(least.size()), tile);
  for (int column = 0; column < columns_; ++column) {
    least_[(row + 1) * stride_ + 1 + column] = least[column * tile];
    const float brightest = greatest_[(row + 1) * stride_ + 1 + column] = greatest[column * tile];
    saturated_[(row + 1) * stride_ + 1 + column] = brightest >= full_ ? saturated_share(frame, column * tile, top) : 0;
  }
}

/// The share of a tile's pixels that are saturated.
template <class T>
float Binarizer::saturated_share(const ImageView<T>& frame, int left, int top) const {
  const int right = std::min(left + options_.tile_px, frame.width),
            bottom = std::min(top + options_.tile_px, frame.height);
  std::ptrdiff_t saturated = 0;
  for (int y = top; y < bottom; ++y)
    saturated += std::count_if(frame.row(y) + left, frame.row(y) + right,
                               [&](T level) { return static_cast<float>(level) >= full_; });
  return static_cast<float>(saturated) / static_cast<float>((right - left) * (bottom - top));
}

void Binarizer::set_thresholds() {
  const auto least_of = [](float a, float b) { return a < b ? a : b; };
  const auto greatest_of = [](float a, float b) { return a > b ? a : b; };
  const auto sum_of = [](float a, float b) { return a + b; };
  combine_3x3(least_, stride_, least_of, across_, low_);
  combine_3x3(greatest_, stride_, greatest_of, across_, high_);
  combine_3x3(saturated_, stride_, sum_of, across_, clipped_);
  midway_.assign(least_.size(), 0);
  for (int row = 1; row <= rows_; ++row) {
    for (int i = row * stride_ + 1; i <= row * stride_ + columns_; ++i) {
      const float contrast = high_[i] - low_[i];
      float midway = low_[i] + options_.level * contrast;
      if (clipped_[i] > 9 * kSaturatedFirst) {
        const float rise = std::min(1.F, (clipped_[i] / 9 - kSaturatedFirst) / (kSaturatedMost - kSaturatedFirst)),
                    highest = std::min(low_[i] + kSaturatedLevel * contrast,
                                       high_[i] - options_.contrast_min_sigma / 3 * noise_.at(high_[i]));
        midway += rise * std::max(0.F, highest - midway);
      }
      const float needed = contrast_min(midway);
      const float nothing_lit = high_[i] + needed;
      midway_[i] = contrast < needed ? nothing_lit : midway;
    }
  }
  combine_3x3(midway_, stride_, sum_of, across_, threshold_);
  for (int row = 1; row <= rows_; ++row) {
    const int tall = 3 - (row == 1) - (row == rows_);
    float* threshold = threshold_.data() + row * stride_;
    const auto mean = [&](int column, int wide) {
      threshold[column] = std::min(threshold[column] / static_cast<float>(tall * wide), full_);
    };
    for (int column = 2; column < columns_; ++column) mean(column, 3);
    mean(1, columns_ == 1 ? 1 : 2);
    if (columns_ > 1) mean(columns_, 2);
  }
}

template <class T>
void Binarizer::compare_rows(const ImageView<T>& frame, int top, int bottom, Buffers& buffers, Mask& mask) const {
  auto& threshold = std::get<RowBuffers<T>>(buffers.rows).threshold;
  threshold.resize(static_cast<std::size_t>(columns_) * options_.tile_px + kLanes);
  for (int y = top; y < bottom; ++y) {
    // Thresholds change little from row to row.
    if (y % kRowsAlike == 0) interpolate_row(y + kRowsAlike / 2, frame.width, buffers, threshold.data());
    Cloned<compare_row<T>>::call(frame.row(y), threshold.data(), frame.width, mask.row(y));
  }
}

template <class T>
void Binarizer::binarize_as(const ImageView<T>& frame, double full, std::optional<FrameNoise> noise, Mask& mask,
                            Executor& executor) {
  constexpr int kTileRows = 8, kRows = 16 * kRowsAlike;  // at once
  if (mask.width() != frame.width || mask.height() != frame.height) mask = Mask(frame.width, frame.height);
  columns_ = (frame.width + options_.tile_px - 1) / options_.tile_px;
  rows_ = (frame.height + options_.tile_px - 1) / options_.tile_px;
  stride_ = columns_ + 2;
  least_.assign(static_cast<std::size_t>(stride_) * (rows_ + 2), std::numeric_limits<float>::max());
  greatest_.assign(least_.size(), 0), saturated_.assign(least_.size(), 0);
  full_ = static_cast<float>(full);
  if (buffers_.size() < static_cast<std::size_t>(executor.workers())) buffers_.resize(executor.workers());
  executor.run(1 + (rows_ + kTileRows - 1) / kTileRows, [&](int part, int worker) {
    if (part == 0) {
      noise_ = noise ? *noise : measure_noise(frame, full);
      return;
    }
    for (int row = (part - 1) * kTileRows; row < std::min(part * kTileRows, rows_); ++row)
      find_extremes(frame, row, std::get<RowBuffers<T>>(buffers_[worker].rows));
  });
  contrast_floor_ = static_cast<float>(options_.contrast_min * full / 255);
  set_thresholds();
  executor.run(1 + (frame.height + kRows - 1) / kRows, [&](int part, int worker) {
    Buffers& buffers = buffers_[worker];
    if (part == 0) {
      edge_blur_px_ = measure_edge_blur(frame, std::get<RowBuffers<T>>(buffers.rows).greatest);
      usual_contrast_sigma_ = measure_usual_contrast();
    } else {
      compare_rows(frame, (part - 1) * kRows, std::min(part * kRows, frame.height), buffers, mask);
    }
  });
}

float Binarizer::measure_usual_contrast() {
  constexpr int kStep = 13;
  contrasts_.clear();
  for (int tile = 0; tile < rows_ * columns_; tile += kStep) {
    const int i = (tile / columns_ + 1) * stride_ + 1 + tile % columns_;
    const float contrast = high_[i] - low_[i], midway = low_[i] + 0.5F * contrast;
    if (contrast >= contrast_min(midway)) contrasts_.push_back(contrast / noise_.at(midway));
  }
  return median_in_place(contrasts_);
}

template <class T>
float Binarizer::measure_edge_blur(const ImageView<T>& frame, std::vector<T>& steepest) {
  constexpr int kStepRows = 37;
  constexpr float kSharpShare = 0.9F;
  const int tile = options_.tile_px;
  steepness_.clear();
  steepest.assign(static_cast<std::size_t>(columns_) * tile, 0);
  for (int y = kStepRows / 2; y + 1 < frame.height; y += kStepRows) {
    Cloned<find_steepest<T>>::call(frame.row(y - 1), frame.row(y), frame.row(y + 1), frame.width, tile, columns_ * tile,
                                   steepest.data());
    const int first = (y / tile + 1) * stride_ + 1;
    for (int column = 0; column < columns_; ++column) {
      const float low = low_[first + column], contrast = high_[first + column] - low;
      if (contrast >= 2 * contrast_min(low + 0.5F * contrast) && contrast > 0)
        steepness_.push_back(0.5F * static_cast<float>(steepest[column * tile]) / contrast);
    }
  }
  if (steepness_.empty()) return 0;
  const auto sharp =
      steepness_.begin() + static_cast<std::ptrdiff_t>(kSharpShare * static_cast<float>(steepness_.size() - 1));
  std::ranges::nth_element(steepness_, sharp);
  // A step blurred by a Gaussian has its steepest slope, 1 / (sqrt(2 pi) sigma) of its height per pixel, at the middle.
  return *sharp > 0 ? 0.399F / *sharp : 0;
}

/// Interpolates thresholds bilinearly between tile centres, rounded down: a pixel above the whole number is above the
/// threshold.
template <class T>
void Binarizer::interpolate_row(int y, int width, Buffers& buffers, T* threshold) const {
  constexpr float kUnit = 1 << kFractionBits<T>;
  const int tile = options_.tile_px;
  const float v = (static_cast<float>(y) + 0.5F) / static_cast<float>(tile) - 0.5F;
  const float inside = std::clamp(v, 0.F, static_cast<float>(rows_ - 1));
  const int above = static_cast<int>(inside), below = std::min(above + 1, rows_ - 1);
  const float fraction = inside - static_cast<float>(above);
  const float* upper = threshold_.data() + (above + 1) * stride_ + 1;
  const float* lower = threshold_.data() + (below + 1) * stride_ + 1;
  auto& [rows, at_centre, step] = buffers;
  at_centre.resize(columns_);
  step.resize(columns_);
  for (int column = 0; column < columns_; ++column) {
    at_centre[column] = static_cast<int>((upper[column] + fraction * (lower[column] - upper[column])) * kUnit);
  }
  // Multiply by the inverse: an integer division takes longer than all the rest.
  const float per_px = 1 / static_cast<float>(tile);
  for (int column = 0; column + 1 < columns_; ++column) {
    step[column] = static_cast<int>(static_cast<float>(at_centre[column + 1] - at_centre[column]) * per_px);
  }
  // Constant before the first centre and after the last.
  const int first = tile / 2, last = first + (columns_ - 1) * tile;
  std::fill_n(threshold, std::min(first, width), static_cast<T>(at_centre.front() >> kFractionBits<T>));
  Cloned<draw_line<T>>::call({at_centre.data(), step.data(), columns_, tile}, threshold + first);
  if (last < width)
    std::fill(threshold + last, threshold + width, static_cast<T>(at_centre.back() >> kFractionBits<T>));
}

void Binarizer::binarize(const GreyView& frame, double full, std::optional<FrameNoise> noise, Mask& mask,
                         Executor& executor) {
  std::visit([&](const auto& view) { binarize_as(view, full, noise, mask, executor); }, frame);
}

}  // namespace slsd
