// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "core/executor.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/image.hpp"
#include "core/regions/mask.hpp"

namespace slsd {

struct BinarizeOptions {
  /// Side of a tile in camera pixels. A threshold comes from 3x3 tiles, which have to contain a symbol and a gap: half
  /// the pitch of the grid in the camera.
  int tile_px = 12;
  /// Threshold's place between dark and light. Below the middle, a symbol whose parts touch at a corner stays in one
  /// piece; at the middle, neighbours less than two pixels apart stay separate.
  float level = 0.5F;
  /// Smallest difference between light and dark that counts as the pattern, of 255 levels.
  int contrast_min = 5;
  /// The same in standard deviations of the noise midway between them: somewhat more than the range that noise alone
  /// spans in a window.
  float contrast_min_sigma = 9;
};

/// Separates lit from dark by a local threshold, midway between the least and the greatest grey value around each pixel
/// and interpolated between tiles. Unlike one global threshold, it follows light that falls off over the frame. If the
/// symbols are saturated, their light lies beyond the full level, and the threshold is near that level.
/// @thread thread-bound: keeps its buffers
class Binarizer {
 public:
  explicit Binarizer(BinarizeOptions options) : options_(options) {}

  /// @param full  the level of a saturated pixel of the frame
  /// @param mask  resized to the frame
  void binarize(const GreyView& frame, double full, Mask& mask, Executor& executor) {
    binarize(frame, full, std::nullopt, mask, executor);
  }
  /// @param noise  noise of the frame, if known
  void binarize(const GreyView& frame, double full, std::optional<FrameNoise> noise, Mask& mask, Executor& executor);

  [[nodiscard]] const BinarizeOptions& options() const { return options_; }
  /// Smallest difference between light and dark that counted as the pattern in the last frame, if this grey level is
  /// midway.
  [[nodiscard]] float contrast_min(float level) const {
    return std::max(contrast_floor_, options_.contrast_min_sigma * noise_.at(level));
  }
  /// Returns the noise of the last frame.
  [[nodiscard]] const FrameNoise& noise() const { return noise_; }
  /// Blur at the sharpest edges of the last frame, one standard deviation. It follows from their slope between the
  /// tiles' least and greatest values; 0 if there are no edges.
  [[nodiscard]] float edge_blur_px() const { return edge_blur_px_; }
  /// Usual difference between light and dark of the pattern in the last frame, in standard deviations of the noise
  /// midway; 0 if there was none.
  [[nodiscard]] float usual_contrast_sigma() const { return usual_contrast_sigma_; }

 private:
  template <class T>
  struct RowBuffers {
    std::vector<T> threshold, least, greatest;
  };
  /// Buffers of one worker.
  struct Buffers {
    std::tuple<RowBuffers<std::uint8_t>, RowBuffers<std::uint16_t>> rows;
    std::vector<int> at_centre, step;  // for a row of thresholds, binary fractions
  };
  template <class T>
  void binarize_as(const ImageView<T>& frame, double full, std::optional<FrameNoise> noise, Mask& mask,
                   Executor& executor);
  template <class T>
  void find_extremes(const ImageView<T>& frame, int row, RowBuffers<T>& buffers);
  template <class T>
  [[nodiscard]] float saturated_share(const ImageView<T>& frame, int left, int top) const;
  void set_thresholds();
  [[nodiscard]] float measure_usual_contrast();
  template <class T>
  [[nodiscard]] float measure_edge_blur(const ImageView<T>& frame, std::vector<T>& steepest);
  template <class T>
  void compare_rows(const ImageView<T>& frame, int top, int bottom, Buffers& buffers, Mask& mask) const;
  template <class T>
  void interpolate_row(int y, int width, Buffers& buffers, T* threshold) const;

  BinarizeOptions options_;
  FrameNoise noise_;
  float contrast_floor_ = 0, edge_blur_px_ = 0, usual_contrast_sigma_ = 0;
  int columns_ = 0, rows_ = 0;  // number of tiles
  int stride_ = 0;              // columns of the tiles with a border of one all round
  float full_ = 255;            // the level of a saturated pixel
  std::vector<float> least_, greatest_, saturated_, across_, low_, high_, clipped_, midway_, threshold_;
  std::vector<float> steepness_, contrasts_;
  std::vector<Buffers> buffers_;
};

}  // namespace slsd
