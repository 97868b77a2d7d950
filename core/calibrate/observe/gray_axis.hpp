// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace slsd {

/// One axis of a Gray code in a camera's images. The projector's blur may hide the stripes of the finest bits. A
/// pixel's place is then known only to a bin of 2 or 4 projector pixels.
/// @thread reentrant
class GrayAxis {
 public:
  /// @param images  8 bits; the highest bit first, each followed by its inverse; must outlive this object
  explicit GrayAxis(std::span<const cv::Mat> images);

  /// Ignores the finest bits that fewer than half of these camera pixels show.
  void leave_out_unseen(std::span<const cv::Point> pixels);

  /// The centre of the bin that lights a camera pixel, projector px, 0 to a power of two; empty if a bit is uncertain.
  [[nodiscard]] std::optional<double> place_px(const cv::Point& pixel) const;
  /// Width of a bin, projector px.
  [[nodiscard]] int bin_px() const;

 private:
  [[nodiscard]] int contrast(std::size_t bit, const cv::Point& pixel) const;

  std::span<const cv::Mat> images_;
  std::size_t bits_;  // number of readable bits
};

}  // namespace slsd
