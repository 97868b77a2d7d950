// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace slsd {

/// One axis of a Gray code as a camera saw it. The stripes of the finest bits may be lost in the projector's blur;
/// without them a pixel's place is known to a bin of 2 or 4 of the projector's pixels.
/// @thread reentrant
class GrayAxis {
 public:
  /// @param images  8 bits; the highest bit first, each followed by its inverse; they have to outlive this
  explicit GrayAxis(std::span<const cv::Mat> images);

  /// Leaves out the finest bits that fewer than half of these pixels of the camera show.
  void leave_out_unseen(std::span<const cv::Point> pixels);

  /// The middle of the bin that lights a camera pixel, projector px, 0 to a power of two; none where a bit is
  /// uncertain.
  [[nodiscard]] std::optional<double> place_px(const cv::Point& pixel) const;
  /// Width of a bin, projector px.
  [[nodiscard]] int bin_px() const;

 private:
  [[nodiscard]] int contrast(std::size_t bit, const cv::Point& pixel) const;

  std::span<const cv::Mat> images_;
  std::size_t bits_;  // those that are read
};

}  // namespace slsd
